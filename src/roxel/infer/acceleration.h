#pragma once
/// Fewer passes to the same place: EM creeps along where few rays tell voxels apart (docs/passes.md).

#include <cstdint>
#include <utility>
#include <vector>

namespace roxel {

enum class Accelerate { kBoth, kFalling };  ///< which steps: of all opacities, or of those that fall

/// Lengthens each voxel's EM steps of log tau by the secant of its last two: where a step of length s changed
/// the EM step from d' to d, the step that would leave nothing to do is d / ((d' - d) / s). Remembers one
/// pass, so it serves one level of one reconstruction. Different slots may be used from several threads.
class Acceleration {
 public:
  /// A voxel's last step of log tau.
  struct Step {
    float em = 0;    ///< what EM said
    float made = 0;  ///< what was done
  };

  /// No step is made longer than `limit` times itself; 1 changes nothing.
  Acceleration(std::uint32_t slot_count, double limit, Accelerate which = Accelerate::kBoth)
      : limit_(limit), which_(which), last_(limit > 1 ? slot_count : 0) {}

  /// Where to go from optical depth `before`, when EM says `em` (both >= 0). `prior_share` in [0, 1] is the
  /// prior's share of `em`: where neighbours lead each other there is no room for long steps, so none is
  /// longer than 1 + kPerEvidence (1 / prior_share - 1).
  double operator()(std::uint32_t slot, double before, double em, double prior_share);

  /// What is remembered, one a slot or empty: to go on later where this one stands.
  const std::vector<Step>& memory() const { return last_; }
  void recall(std::vector<Step> memory) { last_ = std::move(memory); }

 private:
  static constexpr double kFirst = 2;        ///< times its length: the first step, before there is a secant
  static constexpr double kFarthest = 2.3;   ///< of log tau, unless EM itself goes farther
  static constexpr double kPerEvidence = 2;  ///< measured on head and dtu-scan24: 4 oscillates

  double limit_;
  Accelerate which_;
  std::vector<Step> last_;
};

}  // namespace roxel
