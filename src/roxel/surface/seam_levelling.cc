#include "roxel/surface/seam_levelling.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <tuple>

#include "roxel/base/error.h"

namespace roxel {
namespace {

constexpr int kSteps = 4;         ///< looks along an edge, less one
constexpr float kMost = 0.3f;     ///< no correction is larger, display values
constexpr double kAnchor = 1e-4;  ///< keeps the mean where it is

/// Calls visit(f, k, g) for every edge k of a triangle f over which another view's triangle g lies.
template <class Visit>
void for_each_seam_side(const FaceNeighbours& neighbours, const std::vector<int>& labels,
                        const Visit& visit) {
  for (std::size_t f = 0; f < labels.size(); ++f)
    for (int k = 0; k < 3; ++k) {
      const std::int32_t g = neighbours[f][k];
      if (g >= 0 && labels[f] != kNoView && labels[g] != kNoView && labels[f] != labels[g]) visit(f, k, g);
    }
}

/// The chart point of triangle g at a point of the surface.
std::int32_t at_point(const Mesh& mesh, const ChartPoints& points, std::int32_t g, std::uint32_t point) {
  for (int k = 0; k < 3; ++k)
    if (mesh.triangles[g][k] == point) return points.of_face[g][k];
  return -1;
}

}  // namespace

ChartPoints chart_points(const Mesh& mesh, const std::vector<int>& labels) {
  std::vector<std::pair<std::uint32_t, int>> pairs;
  for (std::size_t f = 0; f < labels.size(); ++f)
    if (labels[f] != kNoView)
      for (const std::uint32_t corner : mesh.triangles[f]) pairs.emplace_back(corner, labels[f]);
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  ChartPoints points;
  for (const auto& [point, view] : pairs) {
    points.point.push_back(point);
    points.view.push_back(view);
  }
  points.of_face.assign(labels.size(), {-1, -1, -1});
  for (std::size_t f = 0; f < labels.size(); ++f)
    if (labels[f] != kNoView)
      for (int k = 0; k < 3; ++k) {
        const std::pair<std::uint32_t, int> wanted{mesh.triangles[f][k], labels[f]};
        points.of_face[f][k] =
            static_cast<std::int32_t>(std::lower_bound(pairs.begin(), pairs.end(), wanted) - pairs.begin());
      }
  return points;
}

std::vector<Seam> seams(const Mesh& mesh, const FaceNeighbours& neighbours, const std::vector<int>& labels,
                        const ChartPoints& points) {
  std::vector<Seam> out;
  for_each_seam_side(neighbours, labels, [&](std::size_t f, int k, std::int32_t g) {
    if (static_cast<std::size_t>(g) < f) return;
    for (const int corner : {k, (k + 1) % 3})
      out.push_back({points.of_face[f][corner], at_point(mesh, points, g, mesh.triangles[f][corner])});
  });
  return out;
}

SeamColors::SeamColors(const Mesh& mesh, const FaceNeighbours& neighbours, const std::vector<int>& labels,
                       const ChartPoints& points)
    : sums_(points.point.size(), Rgb{}), weights_(points.point.size()) {
  for_each_seam_side(neighbours, labels, [&](std::size_t f, int k, std::int32_t) {
    const int next = (k + 1) % 3;
    edges_.push_back({labels[f], points.of_face[f][k], points.of_face[f][next],
                      mesh.points[mesh.triangles[f][k]], mesh.points[mesh.triangles[f][next]]});
  });
  std::stable_sort(edges_.begin(), edges_.end(),
                   [](const Edge& a, const Edge& b) { return a.view < b.view; });
}

void SeamColors::add(int view, const PinholeCamera& camera, const Image& display) {
  const auto first = std::lower_bound(edges_.begin(), edges_.end(), view,
                                      [](const Edge& edge, int v) { return edge.view < v; });
  for (auto edge = first; edge != edges_.end() && edge->view == view; ++edge)
    for (int step = 0; step <= kSteps; ++step) {
      const float t = static_cast<float>(step) / kSteps;
      const Eigen::Vector3d uvz = camera.project(edge->x_from + t * (edge->x_to - edge->x_from));
      const Rgb color = bilinear(display, uvz.x(), uvz.y());
      for (const auto& [node, weight] : {std::pair{edge->from, 1 - t}, {edge->to, t}}) {
        for (int c = 0; c < 3; ++c) sums_[node][c] += weight * color[c];
        weights_[node] += weight;
      }
    }
}

std::vector<Rgb> SeamColors::means() const {
  std::vector<Rgb> out = sums_;
  for (std::size_t i = 0; i < out.size(); ++i)
    for (float& value : out[i]) value = weights_[i] > 0 ? value / weights_[i] : 0.0f;
  return out;
}

std::vector<Rgb> seam_corrections(const ChartPoints& points, const std::vector<Seam>& seams,
                                  const std::vector<Rgb>& seam_colors, double smoothness) {
  const auto count = static_cast<Eigen::Index>(points.point.size());
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(count, 3);
  const auto couple = [&](std::int32_t a, std::int32_t b, double weight) {
    entries.emplace_back(a, a, weight);
    entries.emplace_back(b, b, weight);
    entries.emplace_back(a, b, -weight);
    entries.emplace_back(b, a, -weight);
  };
  for (std::size_t f = 0; f < points.of_face.size(); ++f)
    for (int k = 0; k < 3; ++k)
      if (points.of_face[f][k] >= 0) couple(points.of_face[f][k], points.of_face[f][(k + 1) % 3], smoothness);
  for (const Seam& seam : seams) {
    couple(seam.a, seam.b, 1);
    for (int c = 0; c < 3; ++c) {
      const double difference = seam_colors[seam.b][c] - seam_colors[seam.a][c];
      right(seam.a, c) += difference;
      right(seam.b, c) -= difference;
    }
  }
  for (Eigen::Index i = 0; i < count; ++i) entries.emplace_back(i, i, kAnchor);
  std::vector<Rgb> out(points.point.size(), Rgb{});
  if (seams.empty()) return out;
  Eigen::SparseMatrix<double> matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
  if (solver.info() != Eigen::Success)
    throw NumericalError("seams of the texture: the system cannot be solved");
  const Eigen::MatrixX3d solution = solver.solve(right);
  for (Eigen::Index i = 0; i < count; ++i)
    for (int c = 0; c < 3; ++c) out[i][c] = std::clamp(static_cast<float>(solution(i, c)), -kMost, kMost);
  return out;
}

}  // namespace roxel
