#pragma once
/// Corrections of colour that make neighbouring charts meet: a value a point and chart, small differences
/// within a chart, the seam's difference across it [Lempitsky07].

#include "roxel/surface/view_choice.h"

namespace roxel {

/// Points of a surface as the charts have them: a point that charts of several views meet at counts once for
/// each.
struct ChartPoints {
  std::vector<std::array<std::int32_t, 3>> of_face;  ///< numbers of a triangle's corners; -1: no view
  std::vector<std::uint32_t> point;                  ///< of the surface
  std::vector<int> view;
};
ChartPoints chart_points(const Mesh& mesh, const std::vector<int>& labels);

/// Between two views along the edges where their charts meet: both numbers of one point.
struct Seam {
  std::int32_t a, b;
};
std::vector<Seam> seams(const Mesh& mesh, const FaceNeighbours& neighbours, const std::vector<int>& labels,
                        const ChartPoints& points);

/// Mean colour along the seams near each chart point, as its view shows it.
class SeamColors {
 public:
  SeamColors(const Mesh& mesh, const FaceNeighbours& neighbours, const std::vector<int>& labels,
             const ChartPoints& points);
  /// Looks along all seams of a view in its picture (display values).
  void add(int view, const PinholeCamera& camera, const Image& display);
  /// One a chart point; 0 away from seams.
  std::vector<Rgb> means() const;

 private:
  struct Edge {
    int view;
    std::int32_t from, to;  ///< chart points
    Eigen::Vector3d x_from, x_to;
  };
  std::vector<Edge> edges_;  ///< ascending by view
  std::vector<Rgb> sums_;
  std::vector<float> weights_;
};

/// What is to be added to the display values of each chart point: least squares over seams (difference 0
/// after it) and edges within charts (no difference, `smoothness` times as important). Throws NumericalError
/// where the system cannot be solved.
std::vector<Rgb> seam_corrections(const ChartPoints& points, const std::vector<Seam>& seams,
                                  const std::vector<Rgb>& seam_colors, double smoothness = 0.1);

}  // namespace roxel
