#pragma once
/// A coarse grid over a box, for votes on what is worth keeping.

#include <Eigen/Geometry>
#include <vector>

namespace roxel {

/// n x n x n equal cells; x varies fastest.
class CellGrid {
 public:
  CellGrid(const Eigen::AlignedBox3d& box, int cells_per_side)
      : box_(box), n_(cells_per_side), cell_size_(box.sizes() / cells_per_side) {}

  std::size_t cell_count() const { return static_cast<std::size_t>(n_) * n_ * n_; }
  Eigen::Vector3d cell_size() const { return cell_size_; }

  Eigen::Vector3d centre(std::size_t cell) const {
    const Eigen::Vector3d index(cell % n_, cell / n_ % n_, cell / n_ / n_);
    return box_.min() + (index.array() + 0.5).matrix().cwiseProduct(cell_size_);
  }

  std::vector<Eigen::Vector3d> centres() const {
    std::vector<Eigen::Vector3d> result(cell_count());
    for (std::size_t cell = 0; cell < result.size(); ++cell) result[cell] = centre(cell);
    return result;
  }

  /// The box around all cells that `keep(cell)` says yes to; empty where there is none.
  template <class Keep>
  Eigen::AlignedBox3d bounds_of(const Keep& keep) const {
    Eigen::AlignedBox3d kept;
    for (std::size_t cell = 0; cell < cell_count(); ++cell) {
      if (!keep(cell)) continue;
      kept.extend(Eigen::Vector3d(centre(cell) - 0.5 * cell_size_));
      kept.extend(Eigen::Vector3d(centre(cell) + 0.5 * cell_size_));
    }
    return kept;
  }

 private:
  Eigen::AlignedBox3d box_;
  int n_;
  Eigen::Vector3d cell_size_;
};

}  // namespace roxel
