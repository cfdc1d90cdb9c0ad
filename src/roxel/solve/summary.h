#pragma once
/// What a reconstruction did, why it stopped and what it cost.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace roxel {

struct PassRecord {
  int level = 0;       ///< 1-based
  int pass = 0;        ///< 1-based
  bool draft = false;  ///< on samples of twice the size
  std::int64_t active_voxels = 0;
  std::int64_t rays = 0;   ///< samples of the opacity march
  std::int64_t steps = 0;  ///< ray-voxel steps of the opacity march: existing voxels crossed
  std::int64_t color_steps = 0;
  double mean_log_likelihood = 0;  ///< per observation
  double mean_opacity_change = 0;
  double mean_opacity = 0;
  double seconds = 0;  ///< wall time of the pass
  double color_seconds = 0;
  double opacity_seconds = 0;  ///< wall time of the opacity half, the node's own colours included
  double ns_per_step = 0;      ///< of the opacity march alone, per core
};

/// One fit of the photographs' light, after a pass.
struct LightRecord {
  int level = 0;
  int pass = 0;
  int fitted_views = 0;
  double largest_change = 0;  ///< of any view's light and channel, as a ratio less 1
  double spread = 0;          ///< of the views' log light: root mean square over views and channels
};

/// The fit of the voxels' colours to the photographs (fit_colors.h).
struct ColorFitRecord {
  std::int64_t pixels = 0;  ///< of the photographs, that are looked at
  int rounds = 0;
  double rms_before_percent = 0;  ///< of full scale, as displayed, to first order, of mean colours ...
  double rms_after_percent = 0;   ///< ... and of fitted ones, what the prior costs included
  double seconds = 0;
};

struct LevelRecord {
  double voxel_size = 0;
  std::int64_t voxels_in_box = 0;
  std::int64_t voxels_around = 0;
  bool converged = false;              ///< the mean opacity change fell below the tolerance
  double seconds = 0;                  ///< images, topology and passes
  std::int64_t peak_memory_bytes = 0;  ///< resident while it ran; 0: not known
};

struct StageRecord {
  std::string name;
  double seconds = 0;
  std::int64_t peak_memory_bytes = 0;  ///< resident while it ran; 0: not known
};

struct Summary {
  std::string termination;  ///< "converged" or "pass limit"
  std::vector<LevelRecord> levels;
  std::vector<PassRecord> passes;
  std::vector<LightRecord> light;
  std::optional<ColorFitRecord> color_fit;
  std::vector<StageRecord> stages;
  std::vector<std::string> notes;
  double seconds = 0;
  std::int64_t peak_memory_bytes = 0;  ///< of the process so far

  /// One line for a person.
  std::string brief() const;
};

}  // namespace roxel
