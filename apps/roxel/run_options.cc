#include "run_options.h"

namespace roxel::cli {
namespace {

OptionTable<StageSwitches> make_stage_table() {
  OptionTable<StageSwitches> table;
  table.group("Run");
  table.add("init", &StageSwitches::init)
      .help("Start from the volume of this run instead of from nothing")
      .placeholder("RUN")
      .unset("none");
  table.add("sky", &StageSwitches::sky)
      .help("Take the skies and sky masks of this run, of roxel sky or roxel reconstruct")
      .placeholder("RUN")
      .unset("fitted anew for --illumination sky, else none");
  table.add("sun", &StageSwitches::sun)
      .help(
          "Where the sun stands, for skies that are fitted anew: degrees clockwise from north (+Y), degrees "
          "above the horizon")
      .placeholder("AZ,EL")
      .unit("degrees")
      .range(-360, 360)
      .unset("from time and place, else a bright spot that is surely the sun");
  table.add("sky-masks", &StageSwitches::sky_masks)
      .help("Folder of masks NAME.png by hand, 255 = sky, for skies that are fitted anew")
      .placeholder("DIR")
      .unset("found from variance, colour and luminance");
  table.add("sky-again", &StageSwitches::sky_again)
      .help(
          "After the first level, fit this run's skies a second time, with the rays that the volume leaves "
          "unexplained")
      .source("[Jethwa04] section 7.2.2");
  table.add("dry-run", &StageSwitches::dry_run)
      .help("Say what would be done, and what memory and time it would take");
  table.add("depth", &StageSwitches::depth).help("Depth maps: depth/NAME.exr and .png");
  table.add("render", &StageSwitches::render)
      .help("Pictures of the input views: render/NAME.png and error/NAME.png");
  table.add("mesh", &StageSwitches::mesh)
      .help("The surface from the depth maps: mesh.ply, mesh.glb, mesh.obj; needs --depth");
  table.add("report", &StageSwitches::report).help("A page to look at: report.html");
  table.add("save-surround", &StageSwitches::save_surround)
      .help("Keep the voxels around the box in volume.vdb");
  table.add("export", &StageSwitches::exported, {{"none", Export::kNone}, {"colmap", Export::kColmap}})
      .help("Depth and normals for other programs, too: a COLMAP dense workspace in RUN/colmap");
  return table;
}

OptionTable<RunOptions> make_run_table() {
  OptionTable<RunOptions> table;
  table.include(input_option_table(), &RunOptions::input);
  table.include(stage_table(), &RunOptions::stages);
  table.include(checkpoint_option_table(), &RunOptions::checkpoints);
  table.include(reconstruct_option_table(), &RunOptions::reconstruct);
  table.include(depth_option_table(), &RunOptions::depth);
  table.include(mesh_option_table(), &RunOptions::mesh);
  table.include(common_option_table(), &RunOptions::common);
  return table;
}

}  // namespace

const OptionTable<StageSwitches>& stage_table() {
  static const OptionTable<StageSwitches> table = make_stage_table();
  return table;
}

const OptionTable<RunOptions>& run_table() {
  static const OptionTable<RunOptions> table = make_run_table();
  return table;
}

}  // namespace roxel::cli
