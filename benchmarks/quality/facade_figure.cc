/// Figures 4.12 and 4.13 of the thesis: one patch of a facade as all nodes see it, each in its own light,
/// compared with what it looks like on average, and so are some patches of other surfaces.
///
///     facade_figure DATASET FOLDER [SEED]
///
/// DATASET is one of `roxel synth street`: its true depth, albedo and normals choose the patch (upright, of
/// one colour, seen by most nodes). Writes figure_4_12.jpg, figure_4_13a.svg (as photographed),
/// figure_4_13b.svg (divided by the light of each node) and facade.csv.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "matchers.h"
#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"
#include "roxel/io/dataset_reader.h"
#include "roxel/io/image_bytes.h"
#include "roxel/io/image_file.h"
#include "roxel/io/sky_truth.h"
#include "roxel/report/pictures.h"
#include "roxel/report/svg_plot.h"

namespace {

using namespace roxel;
namespace fs = std::filesystem;

constexpr int kTries = 4000, kOutliers = 6, kPatchRadius = 3, kCropRadius = 30;
constexpr double kFarthest_m = 40, kBehind_m = 0.3;
constexpr float kPlainAlbedo = 0.15f;  ///< relative deviation within a patch of one colour
constexpr float kOtherAlbedo = 0.35f;  ///< relative difference from which a surface is another
constexpr double kNoises = 4;          // as in figure 4.11: the widths of one shade are not those of a screen
constexpr double kMiddle = 0.25;       ///< luminance that the patches' mean is brought to

struct Truth {
  Image depth, normal, albedo;
};

/// A place on a surface.
struct Place {
  Eigen::Vector3d at;
  Eigen::Vector3f albedo;
};

struct Sighting {
  int view_idx, x, y;  ///< pixel in the middle
};

Image planes_as_image(const fs::path& path, const std::vector<std::string>& names) {
  const std::vector<FloatChannel> channels = read_exr_channels(path.string());
  Image image;
  for (std::size_t c = 0; c < names.size(); ++c) {
    const Image* plane = find_channel(channels, names[c]);
    if (!plane) throw_invalid(path.string(), "no channel " + names[c], "what roxel synth writes");
    if (image.empty()) image = Image(plane->width(), plane->height(), static_cast<int>(names.size()));
    for (std::size_t i = 0; i < plane->data().size(); ++i)
      image.data()[i * names.size() + c] = plane->data()[i];
  }
  return image;
}

class Street {
 public:
  explicit Street(const fs::path& folder)
      : folder_(folder), dataset_(read_dataset(folder, {"transforms", "", "", "none", -1})) {
    for (const View& view : dataset_.views) {
      const std::string file = view.name + ".exr";
      truth_.push_back({planes_as_image(folder / "depth" / file, {"Z"}),
                        planes_as_image(folder / "normal" / file, {"R", "G", "B"}),
                        planes_as_image(folder / "albedo" / file, {"R", "G", "B"})});
    }
  }

  const Dataset& dataset() const { return dataset_; }
  const Truth& truth(int view_idx) const { return truth_[view_idx]; }
  Image photograph(int view_idx) const { return read_image(dataset_.views[view_idx].image_path).rgb; }

  /// An upright plain patch at a random pixel, if there is one.
  std::optional<Place> random_place(std::mt19937& engine) const {
    const int v = static_cast<int>(engine() % dataset_.views.size());
    const Truth& truth = truth_[v];
    const int x = kPatchRadius + static_cast<int>(engine() % (truth.depth.width() - 2 * kPatchRadius));
    const int y = kPatchRadius + static_cast<int>(engine() % (truth.depth.height() - 2 * kPatchRadius));
    const float z = *truth.depth.pixel(x, y);
    if (!(z > 0) || z > kFarthest_m || std::abs(truth.normal.pixel(x, y)[2]) > 0.1f ||
        spread(v, x, y) > kPlainAlbedo)
      return std::nullopt;
    const Ray ray = dataset_.views[v].camera.ray(x + 0.5, y + 0.5);
    return Place{ray.origin + z * ray.direction, Eigen::Map<const Eigen::Vector3f>(truth.albedo.pixel(x, y))};
  }

  /// The view of each node that has the place nearest to its middle, where it sees it.
  std::map<int, Sighting> sightings(const Place& place) const {
    std::map<int, Sighting> best;
    std::map<int, double> nearest;
    for (int v = 0; v < static_cast<int>(dataset_.views.size()); ++v) {
      const PinholeCamera& camera = dataset_.views[v].camera;
      const Eigen::Vector3d p = camera.project(place.at);
      const Intrinsics& k = camera.intrinsics;
      if (p.z() <= 0 || p.z() > kFarthest_m) continue;
      const double off = std::hypot(p.x() - k.cx, p.y() - k.cy);
      if (p.x() < kPatchRadius || p.y() < kPatchRadius || p.x() >= k.width - kPatchRadius ||
          p.y() >= k.height - kPatchRadius)
        continue;
      const int x = static_cast<int>(p.x()), y = static_cast<int>(p.y());
      if (std::abs(*truth_[v].depth.pixel(x, y) - p.z()) > kBehind_m || spread(v, x, y) > kPlainAlbedo)
        continue;
      const int node = dataset_.views[v].node_idx;
      if (best.count(node) && nearest[node] <= off) continue;
      best[node] = {v, x, y};
      nearest[node] = off;
    }
    return best;
  }

 private:
  /// Relative deviation of albedo from the middle's (root mean square), 9 where the patch leaves the surface.
  float spread(int v, int x, int y) const {
    const Truth& truth = truth_[v];
    const Eigen::Map<const Eigen::Vector3f> middle(truth.albedo.pixel(x, y)),
        facing(truth.normal.pixel(x, y));
    if (!(middle.norm() > 0)) return 9;
    float sum = 0;
    for (int j = -kPatchRadius; j <= kPatchRadius; ++j)
      for (int i = -kPatchRadius; i <= kPatchRadius; ++i) {
        const Eigen::Map<const Eigen::Vector3f> a(truth.albedo.pixel(x + i, y + j)),
            n(truth.normal.pixel(x + i, y + j));
        if (n.dot(facing) < 0.95f) return 9;
        sum += (a - middle).squaredNorm() / middle.squaredNorm();
      }
    return std::sqrt(sum) / (2 * kPatchRadius + 1);
  }

  fs::path folder_;
  Dataset dataset_;
  std::vector<Truth> truth_;
};

/// The pixels of a patch in a light that is divided out.
Patch patch_of(const Image& photo, const Sighting& seen, const Eigen::Vector3d& light) {
  Patch patch;
  for (int j = -kPatchRadius; j <= kPatchRadius; ++j)
    for (int i = -kPatchRadius; i <= kPatchRadius; ++i) {
      const float* p = photo.pixel(seen.x + i, seen.y + j);
      patch.push_back({1.0f, LinearRgb{p[0] / light[0], p[1] / light[1], p[2] / light[2]}});
    }
  return patch;
}

double luminance(const Patch& patch) {
  double sum = 0;
  for (const auto& [share, c] : patch) sum += 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b;
  return sum / static_cast<double>(patch.size());
}

void scale(Patch& patch, double factor) {
  for (auto& [share, c] : patch) c.r *= factor, c.g *= factor, c.b *= factor;
}

struct Patches {
  std::vector<int> nodes;  ///< of `same`
  std::vector<Patch> same, other;
};

/// One exposure for all, which brings the mean of the patches to a middle grey: what a screen holds.
void expose(Patches& patches) {
  double mean = 0;
  for (const Patch& patch : patches.same) mean += luminance(patch) / static_cast<double>(patches.same.size());
  for (std::vector<Patch>* all : {&patches.same, &patches.other})
    for (Patch& patch : *all) scale(patch, kMiddle / mean);
}

struct Curve {
  std::string matcher;
  std::vector<double> same, other;
};

std::vector<Curve> agreements(const Patches& patches) {
  Patch all;
  for (const Patch& patch : patches.same) all.insert(all.end(), patch.begin(), patch.end());
  std::vector<Curve> curves;
  for (const Matcher& matcher : matchers(kNoises)) {
    // The mean of the patches, without their differences: what a single patch is compared with.
    ColorGaussian reference = matcher.gaussian(all);
    std::fill(std::begin(reference.cov), std::end(reference.cov), 0.0f);
    Curve curve{matcher.name, {}, {}};
    for (const Patch& patch : patches.same)
      curve.same.push_back(matcher.agree(reference, matcher.gaussian(patch)));
    for (const Patch& patch : patches.other)
      curve.other.push_back(matcher.agree(reference, matcher.gaussian(patch)));
    curves.push_back(curve);
  }
  return curves;
}

Plot plot_of(const std::string& title, const std::vector<Curve>& curves, const Patches& patches) {
  Plot plot{title,
            {"the patch in node 1, 2, ..., then other surfaces", 0.5,
             0.5 + static_cast<double>(patches.same.size() + patches.other.size() + 1)},
            {"agreement", 0, 1},
            {}};
  for (const Curve& curve : curves) {
    PlotSeries series{curve.matcher, {}, {}};
    double x = 0;
    for (const double y : curve.same) series.x.push_back(++x), series.y.push_back(y);
    series.x.push_back(++x), series.y.push_back(std::nan(""));  // lifts the pen
    for (const double y : curve.other) series.x.push_back(++x), series.y.push_back(y);
    plot.series.push_back(series);
  }
  return plot;
}

std::string csv_of(const std::string& light, const std::vector<Curve>& curves) {
  std::string text;
  for (const Curve& curve : curves)
    for (const auto& [what, values] : {std::pair{"same", &curve.same}, std::pair{"other", &curve.other}})
      for (std::size_t i = 0; i < values->size(); ++i) {
        char line[160];
        std::snprintf(line, sizeof line, "%s,%s,%s,%zu,%.4f\n", light.c_str(), curve.matcher.c_str(), what,
                      i + 1, (*values)[i]);
        text += line;
      }
  return text;
}

/// What is around a patch, twice as large, with a white frame around what is compared.
Image crop(const Image& photo, const Sighting& seen, double white) {
  const int side = 2 * kCropRadius + 1;
  Image out(2 * side, 2 * side, 3, 0.13f);
  const Image shown = encoded_picture(photo, white, {});
  for (int y = 0; y < 2 * side; ++y)
    for (int x = 0; x < 2 * side; ++x) {
      const int i = x / 2 - kCropRadius, j = y / 2 - kCropRadius, u = seen.x + i, v = seen.y + j;
      const int out_by = std::max(std::abs(i), std::abs(j));
      if (u < 0 || v < 0 || u >= shown.width() || v >= shown.height()) continue;
      for (int c = 0; c < 3; ++c)
        out.pixel(x, y)[c] = out_by == kPatchRadius + 1 ? 1.0f : shown.pixel(u, v)[c];
    }
  return out;
}

void write_figures(const fs::path& data, const fs::path& folder, std::uint32_t seed) {
  const Street street(data);
  std::vector<SkyTruth> skies = read_sky_truth(data);
  std::mt19937 engine(seed);
  std::vector<Place> places;
  for (int i = 0; i < kTries; ++i)
    if (const std::optional<Place> place = street.random_place(engine)) places.push_back(*place);
  if (places.empty()) throw_invalid(data.string(), "no upright patch of one colour", "a street");
  std::size_t chosen = 0;
  std::map<int, Sighting> seen;
  for (std::size_t i = 0; i < places.size(); ++i)
    if (std::map<int, Sighting> found = street.sightings(places[i]); found.size() > seen.size())
      seen = std::move(found), chosen = i;

  Patches raw, divided;
  std::vector<std::vector<Image>> rows(1);
  const auto add = [&](const Sighting& sighting, std::vector<Patch> Patches::*list) {
    const Image photo = street.photograph(sighting.view_idx);
    const int node = street.dataset().views[sighting.view_idx].node_idx;
    if (node >= static_cast<int>(skies.size()))
      throw_invalid(data.string(), "fewer skies than nodes", "a light for each node");
    (raw.*list).push_back(patch_of(photo, sighting, Eigen::Vector3d::Ones()));
    (divided.*list).push_back(patch_of(photo, sighting, skies[node].horizontal / M_PI));
    const double white = 2 * luminance(patch_of(photo, sighting, Eigen::Vector3d::Ones()));
    if (rows.back().size() == 8) rows.emplace_back();
    rows.back().push_back(crop(photo, sighting, std::max(white, 0.05)));
  };
  for (const auto& [node, sighting] : seen) {
    raw.nodes.push_back(node);
    add(sighting, &Patches::same);
  }
  rows.emplace_back();
  const Eigen::Vector3f own = places[chosen].albedo;
  for (std::size_t i = 0; i < places.size() && raw.other.size() < kOutliers; ++i) {
    if ((places[i].albedo - own).norm() < kOtherAlbedo * own.norm()) continue;
    const std::map<int, Sighting> found = street.sightings(places[i]);
    if (!found.empty()) add(found.begin()->second, &Patches::other);
  }
  expose(raw);
  expose(divided);
  const std::vector<Curve> as_seen = agreements(raw), without_light = agreements(divided);
  write_text_atomically(folder / "figure_4_12.jpg", jpeg_bytes(contact_sheet(rows)));
  write_text_atomically(folder / "figure_4_13a.svg",
                        svg_plot(plot_of("One patch in every node's light", as_seen, raw)));
  write_text_atomically(folder / "figure_4_13b.svg",
                        svg_plot(plot_of("The same, divided by each node's light", without_light, divided)));
  write_text_atomically(folder / "facade.csv", "light,agreement,surface,number,value\n" +
                                                   csv_of("as photographed", as_seen) +
                                                   csv_of("divided", without_light));
  std::printf("patch at %.2f %.2f %.2f, seen by %zu nodes\n", places[chosen].at.x(), places[chosen].at.y(),
              places[chosen].at.z(), seen.size());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3 || argc > 4) {
    std::fprintf(stderr, "usage: %s DATASET FOLDER [SEED]\n", argv[0]);
    return 2;
  }
  try {
    write_figures(argv[1], argv[2],
                  argc > 3 ? static_cast<std::uint32_t>(std::strtoul(argv[3], nullptr, 10)) : 1);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 1;
  }
  return 0;
}
