/// What belief propagation over depth maps costs: 50 sweeps over images of growing size, on one thread, in
/// processor time. Evidence is as uneven as that of a volume: deviations of pixels differ a hundredfold, and
/// every tenth pixel has none.

#include <cmath>
#include <cstdio>
#include <random>

#include "processor_time.h"
#include "roxel/depth/gaussian_lattice.h"

namespace {

using namespace roxel;

constexpr int kSweeps = 50;

/// A slope with noise; ties know the slope.
GaussianLattice noisy_slope(int side) {
  std::mt19937 random(1);
  std::normal_distribution<float> noise;
  std::uniform_real_distribution<float> share(0, 1);
  GaussianLattice field(side, side);
  field.right_step.assign(field.mean.size(), 0.001f);
  field.down_step.assign(field.mean.size(), 0.002f);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * side + x;
      const float sigma = 0.001f * std::pow(100.0f, share(random));
      field.precision[i] = share(random) < 0.1f ? 0.0f : 1 / (sigma * sigma);
      field.mean[i] =
          5 + 0.001f * static_cast<float>(x) + 0.002f * static_cast<float>(y) + sigma * noise(random);
      field.right[i] = x + 1 < side ? 1e5f * share(random) : 0.0f;
      field.down[i] = y + 1 < side ? 1e5f * share(random) : 0.0f;
    }
  return field;
}

}  // namespace

int main() {
  std::printf("    pixels   sweeps   seconds   s per megapixel\n");
  for (const int side : {250, 500, 1000, 2000}) {
    const GaussianLattice field = noisy_slope(side);
    const double start = processor_seconds();
    const LatticeBeliefs beliefs = propagate(field, {MessageSchedule::kSynchronous, kSweeps, 0});
    const double seconds = processor_seconds() - start;
    const double megapixels = 1e-6 * static_cast<double>(field.mean.size());
    std::printf("%10zu %8d %9.3f %17.3f\n", field.mean.size(), beliefs.sweeps, seconds, seconds / megapixels);
  }
}
