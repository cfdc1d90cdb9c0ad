#include "roxel/solve/options.h"

namespace roxel {

namespace {

using Options = ReconstructOptions;

void add_volume(OptionTable<Options>& table) {
  table.group("Volume");
  table.add("bounds", &Options::bounds)
      .help("Box to reconstruct: x0,y0,z0,x1,y1,z1, or a text file with these six numbers")
      .unit("world units")
      .or_file()
      .unset("from the data set, its points, masks, or cameras")
      .source("docs/datasets.md, \"Which box?\"");
  table.add("near", &Options::near)
      .help("Nearest depth that is looked for")
      .unit("world units")
      .above(0)
      .unset("from the cameras and points")
      .source("docs/datasets.md, \"Which box?\"");
  table.add("far", &Options::far)
      .help("Depth at which rays end")
      .unit("world units")
      .above(0)
      .unset("from the cameras and points")
      .source("docs/datasets.md, \"Which box?\"");
  table.add("voxel-size", &Options::voxel_size)
      .help("Edge of the finest voxels; overrides --resolution")
      .unit("world units")
      .above(0)
      .unset("from --resolution")
      .source("--resolution means the same in data sets of any unit");
  table.add("resolution", &Options::resolution)
      .help("Finest voxels along the longest side of the box")
      .range(8, 65536)
      .source("chosen for cost: 512 takes about four times the time and memory (docs/reconstruct.md)");
  table.add("levels", &Options::levels)
      .help("Levels of resolution, each with half the voxel size of the one before")
      .range(1, 16)
      .source("[Jethwa04] section 5.2.2");
  table.add("passes", &Options::passes)
      .help("Most passes of the last level; of those before: --coarse-passes")
      .range(1, 10000)
      .source("measured on plane and head");
  table.add("coarse-passes", &Options::coarse_passes)
      .help(
          "Most passes of each level before the last, which are cheap; 0: as many as --passes, twice as many "
          "where masks of objects say what is background")
      .range(0, 10000)
      .source("what more and fewer are worth: docs/passes.md");
  table.add("draft-passes", &Options::draft_passes)
      .help(
          "First passes of a level that look at samples of twice the size, a quarter as many; the last pass "
          "never does")
      .range(0, 10000)
      .source("measured on plane, head and dtu-scan24");
  table.add("tolerance", &Options::tolerance)
      .help("Mean change of opacity in a pass that ends a level")
      .range(0, 1)
      .source("chosen, not measured: far below a change that shows");
  table.add("all-passes", &Options::all_passes)
      .help("Do all passes of every level, whatever the tolerance")
      .source("for experiments of a fixed cost");
  table
      .add("surround", &Options::surround,
           {{"auto", SurroundChoice::kAuto}, {"on", SurroundChoice::kOn}, {"off", SurroundChoice::kOff}})
      .help(
          "Ever coarser voxels around the box, out to the far distance, so that every ray has a place to "
          "end; "
          "auto: where the background is not known")
      .source("docs/volume.md; docs/background.md");
  table.add("min-overlap", &Options::min_overlap)
      .help(
          "Leave out places that fewer than two nodes have in frame, or than this share of the most that "
          "have what "
          "lies behind (of less, where those are not two thirds of all): nothing hangs before the cameras "
          "where a few "
          "photographs agree by chance; 0: none")
      .range(0, 1)
      .source("docs/volume.md; measured on dtu-scan24 without masks");
  table.add("memory", &Options::memory)
      .help(
          "Keep to this much memory: samples that do not fit are made anew in each pass, refinement holds "
          "fewer "
          "views, and a surface whose lattice does not fit is an error; results are the same")
      .unit("GiB")
      .above(0)
      .unset("what the machine has at hand")
      .source("docs/reconstruct.md: results are the same, only slower with less");
}

void add_sampling(OptionTable<Options>& table) {
  table.group("Sampling");
  table.add("adaptive", &Options::adaptive)
      .help("Rays start coarse and divide with distance")
      .source("[Jethwa04] section 5.1.1");
  table.add("samples-per-voxel", &Options::samples_per_voxel)
      .help("Samples across a voxel, along an axis")
      .range(0.25, 16)
      .source("2 takes twice the steps for half a point of depths (docs/rays.md)");
  table.add("interpolate", &Options::interpolate)
      .help("Interpolate the image at each voxel centre's projection")
      .source("a switch of the thesis's program; not measured here, and slower: rays march one by one");
  table.add("observation-weight", &Options::observation_weight)
      .help("Observations that one image makes of a voxel in the middle of the box")
      .above(0)
      .source("one image, one observation; chosen when 4 and 1 were compared, figures not kept");
  table.add("outline-weight", &Options::outline_weight)
      .help(
          "Where masks say what is background: weight of pixels that the object's outline halves; of less "
          "even halves it is nearer to 1. 1: all pixels alike")
      .range(0, 1)
      .source("docs/background.md; masks of all or nothing have no such pixels");
}

void add_color(OptionTable<Options>& table) {
  table.group("Colour");
  table
      .add("color-space", &Options::color_space,
           {{"luv", ColorSpace::kLuv},
            {"rgb", ColorSpace::kRgb},
            {"srgb", ColorSpace::kSrgb},
            {"hsv", ColorSpace::kHsv}})
      .help("Space that colours are compared in")
      .source("[Jethwa04] section 4.3");
  table.add("white-point", &Options::white_point)
      .help("White of CIE Luv: D65, A, C, or chromaticities x,y")
      .source("[Jethwa04] section 9.2");
  table.add("noise", &Options::noise)
      .help("Standard deviation of colour that is always granted")
      .unit("units of the colour space")
      .range(1e-4, 1000)
      .unset("3 in Luv, the same share of the gamut elsewhere")
      .source(
          "3: measured on head and dtu-scan24; elsewhere so that an unknown colour is worth the same "
          "(docs/color.md)");
  table
      .add("agreement", &Options::agreement,
           {{"gaussian", Agreement::kGaussian},
            {"exponential", Agreement::kExponential},
            {"linear", Agreement::kLinear}})
      .help("How two colours are matched")
      .source("[Jethwa04] eq. (4.5), (4.2), (4.1)");
  table.add("agreement-scale", &Options::agreement_scale)
      .help("Scale of exponential and linear agreement")
      .unit("units of the colour space")
      .above(0)
      .unset("2.5 times the noise (exponential), 5 times (linear)")
      .source(
          "by formula: exp(-d^2/scale^2) is as wide as Gaussian agreement of two colours that each spread by "
          "the noise (sqrt 6 of it); linear ends where that is 2 %");
  table.add("outlier", &Options::outlier)
      .help("Floor of every likelihood")
      .range(0, 1)
      .source("far below what an unknown colour is worth, 3e-4; only keeps logarithms finite");
  table.add("uninformative", &Options::uninformative)
      .help("Likelihood of a colour where a voxel has no evidence")
      .range(0, 1)
      .unset("that of an unknown background")
      .source("docs/background.md: the two must be one density, or clutter hangs before the cameras");
  table.add("evidence-half", &Options::evidence_half)
      .help("Colour evidence, in nodes, at which a voxel's own colour counts half")
      .range(0, 1000)
      .source("measured with and without masks: docs/passes.md");
  table.add("predictive", &Options::predictive)
      .help("Compare a ray with what other nodes saw, leaving its own out")
      .source("docs/passes.md: without, clutter grows before every camera");
  table.add("fit-colors", &Options::fit_colors)
      .help("Paint voxels with the colours whose interpolated render is nearest to the photographs")
      .source(
          "measured: errors of photographs that were left out fall by 25, 10 and 4 % on plane, head and "
          "templeSparseRing (docs/color.md)");
}

void add_light(OptionTable<Options>& table) {
  table.group("Light");
  table
      .add("illumination", &Options::illumination,
           {{"auto", IlluminationChoice::kAuto},
            {"none", IlluminationChoice::kNone},
            {"gain", IlluminationChoice::kGain},
            {"sky", IlluminationChoice::kSky},
            {"sky-normal", IlluminationChoice::kSkyNormal}})
      .help(
          "Light that is divided out of the photographs: none, one gain an image and channel, or the light "
          "of each node's sky; sky-normal: voxels are painted, too, without what light falls on their own "
          "surface, shading and cast shadows; auto: sky where --sky is given or the photographs of several "
          "times and places show it, gain where the images turn out to differ by more than a third, else "
          "none")
      .source("[Jethwa04] section 7.2.3; docs/light.md");
  table
      .add("sky-light", &Options::sky_light,
           {{"horizontal", DomeLight::kHorizontal}, {"mean", DomeLight::kMean}})
      .help(
          "What the light of a sky is worth: what falls on the horizontal, the sun's included, or the plain "
          "mean "
          "of the dome")
      .source("[Jethwa04] section 7.2.3; docs/light.md");
  table
      .add("matching", &Options::matching,
           {{"auto", Matching::kAuto}, {"canonical", Matching::kCanonical}, {"local", Matching::kLocal}})
      .help(
          "What rays and voxels are compared by: colours under canonical light, or without the light of "
          "their neighbourhood")
      .source("docs/light.md");
  table.add("matching-blur", &Options::matching_blur)
      .help("Standard deviation of that neighbourhood")
      .unit("degrees")
      .range(0.05, 90)
      .source("chosen, not measured: shading is wider, texture narrower (docs/light.md)");
}

void add_background(OptionTable<Options>& table) {
  table.group("Background");
  table
      .add("background", &Options::background,
           {{"auto", BackgroundChoice::kAuto},
            {"none", BackgroundChoice::kNone},
            {"unknown", BackgroundChoice::kUnknown},
            {"black", BackgroundChoice::kBlack},
            {"constant", BackgroundChoice::kConstant},
            {"mask", BackgroundChoice::kMask},
            {"sky", BackgroundChoice::kSky}})
      .help(
          "What a ray sees that passes every voxel; sky: what the masks of skies say, those of --sky or "
          "fitted "
          "in this run, and anything in photographs whose sky is not known")
      .source("docs/background.md");
  table.add("background-color", &Options::background_color)
      .help("Colour of a constant background, which it implies: linear r,g,b")
      .unset("estimated from the images' borders")
      .source("docs/background.md");
  table.add("filter-rays", &Options::filter_rays)
      .help("Remove what a voxel explains from the sample behind it")
      .source("[Jethwa04] appendix B, -fc");
  table.add("empty-sky", &Options::empty_sky)
      .help(
          "Where masks of skies are the background: after each level, empty voxels whose footprint is nearly "
          "all "
          "sky in a photograph, or in those of two nodes where they are more opaque than not")
      .source("[Kutulakos00]; docs/light.md");
  table.add("filter-background", &Options::filter_background)
      .help("Remove a known background's share from samples")
      .source("[Jethwa04] appendix B, -fbg");
}

void add_opacity(OptionTable<Options>& table) {
  table.group("Opacity");
  table
      .add("update", &Options::update,
           {{"posterior", UpdateRule::kPosterior}, {"roxels", UpdateRule::kRoxels}})
      .help("How a pass updates opacities")
      .source("docs/passes.md; [DeBonet99]");
  table.add("spatial-prior", &Options::spatial_prior)
      .help("Weight of the neighbours' opacity in the prior: surfaces are sheets")
      .range(0, 1)
      .source("docs/passes.md; raised when the thirteen planes came, figures not kept");
  table.add("prior-sharpness", &Options::prior_sharpness)
      .help(
          "Power that the odds of the neighbours' opacity are raised to in the prior of the run's last pass: "
          "surfaces are opaque; 1: none")
      .range(1, 10)
      .source("docs/passes.md; measured on plane and head");
  table.add("prior-strength", &Options::prior_strength)
      .help("Weight of the prior")
      .unit("observations")
      .at_least(0)
      .source("measured on plane and head");
  table.add("prior-opacity", &Options::prior_opacity)
      .help("Opacity of a voxel about which nothing is known")
      .above(0)
      .below(1)
      .source("chosen: light goes fifty such voxels far on average");
  table.add("acceleration", &Options::acceleration)
      .help(
          "Longest step of an opacity, in times the pass's own, where passes keep going the same way; 1: "
          "none")
      .range(1, 100)
      .source("docs/passes.md; measured on plane and head");
  table.add("ray-weights", &Options::ray_weights)
      .help("Weigh opacity sums, too, by how near a ray passes to the voxel's centre")
      .source("docs/passes.md: without them no pass lowers the posterior");
  table.add("opacity-threshold", &Options::opacity_threshold)
      .help("Voxels below this opacity are dropped between levels and left out of voxels.ply")
      .range(0, 0.999)
      .source("twice --prior-opacity: what photographs have not raised above the prior goes");
  table.add("confidence-threshold", &Options::confidence_threshold)
      .help("Voxels below this confidence are dropped between levels and left out of voxels.ply")
      .range(0, 0.999)
      .source("measured on head and dtu-scan24");
}

OptionTable<Options> make_table() {
  OptionTable<Options> table;
  add_volume(table);
  add_sampling(table);
  add_color(table);
  add_light(table);
  add_background(table);
  add_opacity(table);
  table.rule([](const Options& o) -> std::string {
    if (!o.bounds) return "";
    for (int axis = 0; axis < 3; ++axis)
      if ((*o.bounds)[axis] >= (*o.bounds)[axis + 3])
        return "--bounds: the first corner must be below the second in x, y and z";
    return "";
  });
  table.rule([](const Options& o) -> std::string {
    return o.near && o.far && *o.near >= *o.far ? "--near must be below --far" : "";
  });
  return table;
}

}  // namespace

const OptionTable<ReconstructOptions>& reconstruct_option_table() {
  static const OptionTable<ReconstructOptions> table = make_table();
  return table;
}

}  // namespace roxel
