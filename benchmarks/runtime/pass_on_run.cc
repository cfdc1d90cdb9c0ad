/// What one full pass costs on a finished run's volume and its photographs:
///
///     pass_on_run DATASET RUN [IMAGES [THREADS [PASSES]]]
///
/// RUN is the folder of a `roxel reconstruct DATASET` with bounds or masks (its volume.vdb holds the box, no
/// surround). IMAGES, a pattern, keeps some of the photographs. Prints rays, steps and nanoseconds of
/// processor time a step of PASSES passes, of the colour and of the opacity march.

#include <cstdio>
#include <cstdlib>

#include "roxel/base/error.h"
#include "roxel/io/dataset_reader.h"
#include "roxel/io/photograph.h"
#include "roxel/io/volume_file.h"
#include "roxel/solve/reconstruct.h"

namespace {

using namespace roxel;

ReconstructOptions options_for(const Volume& volume) {
  const LatticeFrame& frame = volume.index(0).frame();
  const Eigen::AlignedBox3d box = frame.box();
  ReconstructOptions options;
  options.bounds = {box.min().x(), box.min().y(), box.min().z(), box.max().x(), box.max().y(), box.max().z()};
  options.voxel_size = frame.voxel_size;
  options.levels = 1;
  return options;
}

void measure(const char* dataset_path, const char* run, const char* images, int threads, int passes) {
  ReadOptions read;
  read.images = images;
  const Dataset dataset = read_dataset(dataset_path, read);
  Volume volume = read_volume(std::filesystem::path(run) / "volume.vdb").volume;
  const ReconstructOptions options = options_for(volume);
  const RunContext context(threads);
  const PhotographLoader load = make_photograph_loader();
  const Scene scene = survey(dataset, load, options, context);
  const std::vector<SampleNode> samples =
      make_samples(dataset, load, scene, scene.voxel_size, options, context);
  std::printf("%zu images, %u voxels, %d threads\n%6s %12s %12s %9s %9s | %12s %12s %9s %9s | %s\n",
              dataset.views.size(), volume.slot_count(), threads, "pass", "color rays", "steps", "wall s",
              "ns/step", "rays", "steps", "wall s", "ns/step", "mean log-likelihood");
  PassMemory memory;
  for (int pass = 1; pass <= passes; ++pass) {
    const PassReport report =
        run_pass(samples, pass_options(scene, options), context, nullptr, volume, nullptr, &memory);
    std::printf("%6d %12lld %12lld %9.2f %9.1f | %12lld %12lld %9.2f %9.1f | %.6f\n", pass,
                static_cast<long long>(report.color.rays), static_cast<long long>(report.color.steps),
                report.color_seconds,
                1e9 * report.color_march_cpu_seconds / static_cast<double>(report.color.steps),
                static_cast<long long>(report.opacity.rays), static_cast<long long>(report.opacity.steps),
                report.opacity_seconds,
                1e9 * report.opacity_march_cpu_seconds / static_cast<double>(report.opacity.steps),
                report.opacity.log_likelihood / report.opacity.observation_weight);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3 || argc > 6) {
    std::fprintf(stderr, "usage: %s DATASET RUN [IMAGES [THREADS [PASSES]]]\n", argv[0]);
    return 2;
  }
  try {
    measure(argv[1], argv[2], argc > 3 ? argv[3] : "", argc > 4 ? std::atoi(argv[4]) : 1,
            argc > 5 ? std::atoi(argv[5]) : 6);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 2;
  }
  return 0;
}
