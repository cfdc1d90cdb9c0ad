/// Figure 5.4 of the thesis: how often one image's samples update a voxel.
///
///     update_figure FOLDER
///
/// A block of voxels before a camera, from near to eight times as far, with and without adaptive sampling,
/// with and without ray weights. Writes figure_5_4.svg and updates.csv.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "roxel/base/atomic_file.h"
#include "roxel/infer/update_fixture.h"
#include "roxel/report/svg_plot.h"

namespace {

using namespace roxel;

using fixture::Tunnel;
using fixture::UpdateCounter;

constexpr int kMostCounted = 24;
constexpr double kSamplesPerVoxel =
    0.7;  // a sample's diagonal is at most a voxel's side, as the thesis has it

/// Share of the voxels, in percent, with about 0, 1, 2, ... updates; the last holds all that have more.
PlotSeries histogram(const std::string& name, const std::vector<double>& updates, PlotStyle style) {
  PlotSeries series{name, {}, {}, style};
  for (int i = 0; i <= kMostCounted; ++i) series.x.push_back(i), series.y.push_back(0);
  for (const double count : updates)
    series.y[std::min<long>(std::lround(count), kMostCounted)] += 100.0 / static_cast<double>(updates.size());
  return series;
}

void write_figure(const std::filesystem::path& folder) {
  const Tunnel tunnel;
  const SampleView fixed_view = tunnel.view(false, kSamplesPerVoxel);
  const SampleView adaptive_view = tunnel.view(true, kSamplesPerVoxel);
  const UpdateCounter fixed(tunnel.volume(), fixed_view), adaptive(tunnel.volume(), adaptive_view);
  const Plot plot{"Updates of a voxel by one image",
                  {"updates (24: and more)", 0, kMostCounted},
                  {"voxels [%]", 0},
                  {histogram("one size", fixed.plain, PlotStyle::kLine),
                   histogram("one size, weighted", fixed.weighted, PlotStyle::kDashes),
                   histogram("adaptive", adaptive.plain, PlotStyle::kLine),
                   histogram("adaptive, weighted", adaptive.weighted, PlotStyle::kDashes)}};
  write_text_atomically(folder / "figure_5_4.svg", svg_plot(plot));
  std::string csv = "updates,fixed,fixed_weighted,adaptive,adaptive_weighted\n";
  for (int i = 0; i <= kMostCounted; ++i) {
    char line[160];
    std::snprintf(line, sizeof line, "%d,%.2f,%.2f,%.2f,%.2f\n", i, plot.series[0].y[i], plot.series[1].y[i],
                  plot.series[2].y[i], plot.series[3].y[i]);
    csv += line;
  }
  write_text_atomically(folder / "updates.csv", csv);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: %s FOLDER\n", argv[0]);
    return 2;
  }
  try {
    write_figure(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 1;
  }
  return 0;
}
