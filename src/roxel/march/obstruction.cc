#include "roxel/march/obstruction.h"

#include "roxel/base/fast_exp.h"

namespace roxel {

Obstruction ObstructionMarch::look(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  Obstruction found;
  float most = 0;
  const std::vector<float>& tau = stack_.volume().tau;
  const Stretch all{0, std::numeric_limits<double>::infinity()};
  stack_.walk_chunks(
      {origin, direction}, all, nullptr, chunk_, [](std::uint32_t) {},
      [&](const StepChunk& steps) {
        for (int i = 0; i < steps.count; ++i) {
          const float a = one_minus_exp(tau[steps.slot[i]] * steps.length[i]);
          if (const float stopped = a * found.transmittance; stopped > most)
            most = stopped, found.at = steps.slot[i];
          found.transmittance *= 1 - a;
        }
        return found.transmittance > kDark;
      });
  if (found.transmittance <= kDark) found.transmittance = 0;
  return found;
}

}  // namespace roxel
