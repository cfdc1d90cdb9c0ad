#pragma once
/// Which photograph each triangle takes its texture from: a labelling that weighs quality against seams
/// [Lempitsky07] [Waechter14].

#include "roxel/surface/texture_views.h"

namespace roxel {

struct ViewChoiceOptions {
  double seam_cost = 0.6;   ///< of neighbours with different views; 1 = what a view of no quality costs
  double transient = 0.12;  ///< views whose colour is farther from the median of the views' are left out, in
                            ///< display values, where three or more see the triangle
  int threads = 1;
};

inline constexpr int kNoView = -1;

/// Multiplies each view's quality by its detail, compared with the median of the triangle's views: a blurred
/// photograph counts down to a third. One that has more than others gains little, since what it has may be
/// the outline of something in front.
void weigh_sharpness(std::vector<std::vector<FaceView>>& views, int threads);

/// Takes out the views that disagree with the others on a triangle's colour, and on those of most of the
/// triangles around it: what stood there for a moment. Returns how many. Colours are compared after the gains
/// of their views; `canonical` (one a triangle, or empty) has a voice of its own among them.
std::int64_t drop_transients(const FaceNeighbours& neighbours, const std::vector<Rgb>& gains,
                             const std::vector<Rgb>& canonical, const ViewChoiceOptions& options,
                             std::vector<std::vector<FaceView>>& views);

/// The view of every triangle, kNoView where none sees it. By loopy belief propagation (min-sum, damped, all
/// triangles at once) and then single changes for the better. The same for any number of threads.
std::vector<int> choose_views(const FaceNeighbours& neighbours,
                              const std::vector<std::vector<FaceView>>& views,
                              const ViewChoiceOptions& options);

}  // namespace roxel
