#pragma once
/// For tests and benchmarks: one pass over all nodes as docs/passes.md prints it. A dense grid, plain loops,
/// doubles, no bricks, no early stop, no fixed point. One lattice, no filters.

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "roxel/infer/run_pass.h"
#include "roxel/march/ray_twin.h"

namespace roxel {

/// Summed weight and first and second moments of colours.
struct TwinColor {
  double weight = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();

  Eigen::Vector3d mean() const {
    return weight > 0 ? Eigen::Vector3d(first / weight) : Eigen::Vector3d::Zero();
  }
  Eigen::Matrix3d cov() const {
    if (weight <= 0) return Eigen::Matrix3d::Zero();
    return second / weight - mean() * mean().transpose();
  }
  void add(double w, const Eigen::Vector3d& m, const Eigen::Matrix3d& s) {
    weight += w;
    first += w * m;
    second += w * (s + m * m.transpose());
  }
  void add(double factor, const TwinColor& other) {
    weight += factor * other.weight;
    first += factor * other.first;
    second += factor * other.second;
  }
};

inline Eigen::Vector3d twin_vector(const float m[3]) { return {m[0], m[1], m[2]}; }
inline Eigen::Matrix3d twin_matrix(const float s[6]) {
  Eigen::Matrix3d m;
  m << s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2];
  return m;
}

/// Equations (4.5), (4.2) and (4.1) of [Jethwa04]; `s` is the sum of both covariances, noise not included.
inline double twin_agreement(const MatchModel& model, const Eigen::Vector3d& d, const Eigen::Matrix3d& s) {
  if (model.agreement == Agreement::kExponential)
    return std::exp(-d.squaredNorm() / (model.scale * model.scale));
  if (model.agreement == Agreement::kLinear) return std::max(0.0, 1 - d.norm() / model.scale);
  const Eigen::Matrix3d noise = twin_vector(model.noise_variance).asDiagonal();
  const Eigen::Matrix3d s_12 = s + noise;
  return std::sqrt(noise.determinant() / s_12.determinant()) * std::exp(-0.5 * d.dot(s_12.inverse() * d));
}

inline double twin_background_agreement(const Background& background, const MatchModel& model,
                                        const RegionStats& sample) {
  return twin_agreement(model, twin_vector(background.mean) - twin_vector(sample.mean),
                        twin_matrix(background.cov) + twin_matrix(sample.cov));
}

inline double twin_known_share(const Background& background, const MatchModel& model,
                               const RegionStats& sample) {
  if (background.kind != BackgroundKind::kKnown) return 0;
  return twin_background_agreement(background, model, sample);
}

inline double twin_background(const Background& background, const MatchModel& model, bool masked,
                              const RegionStats& sample) {
  if (background.kind == BackgroundKind::kNone) return 0;
  if (background.kind == BackgroundKind::kUnknown) return background.unknown_likelihood;
  if (background.kind == BackgroundKind::kMask && !masked)
    return background.unknown_likelihood +
           background.smooth_share * twin_background_agreement(background, model, sample);
  if (background.kind == BackgroundKind::kMask) return 1 - sample.foreground + model.outlier;
  return twin_known_share(background, model, sample) + model.outlier;
}

/// One existing voxel on a sample's ray.
struct TwinStep {
  int cell;
  double length, weight;
  double a = 0, p = 0, e = 0;  ///< opacity, likelihood, mean path of an ending inside
  double r = 0, reach = 0;     ///< responsibility, and probability of getting here
};

/// A sample with the samples that it divides into.
struct TwinSample {
  Region region;
  double weight = 0;  ///< observation weight
  std::vector<TwinStep> steps;
  double transmittance = 1, likelihood = 0;  ///< T and Z of its own stretch
  double background_likelihood = 0;
  double z = 0;
  double background = 0;  ///< leaves: responsibility of the background
  double path_sum = 0;    ///< roxels: the largest sum of agreements to a leaf, background included
  std::vector<TwinSample> children;
};

struct TwinVoxel {
  bool exists = false;
  double tau = 0;
  double hits = 0, exposure = 0, looked = 0;
  TwinColor color;  ///< totals of all nodes
};

/// The volume as a dense array of cells, x fastest, and the pass over it.
class PassTwin {
 public:
  PassTwin(const Volume& volume, const PassOptions& options)
      : options_(options),
        frame_(volume.index(0).frame()),
        size_(frame_.size_in_voxels()),
        voxels_(size_.prod()) {
    for (int cell = 0; cell < size_.prod(); ++cell) {
      const std::uint32_t slot = volume.index(0).slot(ijk(cell));
      if (slot == kNoSlot) continue;
      voxels_[cell].exists = true;
      voxels_[cell].tau = volume.tau[slot];
    }
  }

  Eigen::Vector3i ijk(int cell) const {
    return {cell % size_.x(), cell / size_.x() % size_.y(), cell / (size_.x() * size_.y())};
  }
  int cell(const Eigen::Vector3i& at) const { return at.x() + size_.x() * (at.y() + size_.y() * at.z()); }
  const std::vector<TwinVoxel>& voxels() const { return voxels_; }
  double log_likelihood() const { return log_likelihood_; }

  /// Colour, opacity and update of one pass.
  void run(const std::vector<SampleNode>& nodes) {
    const std::vector<std::vector<TwinColor>> own = collect_color(nodes);
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      others_.assign(voxels_.size(), {});
      for (std::size_t v = 0; v < voxels_.size(); ++v) {
        others_[v] = voxels_[v].color;
        if (options_.predictive) others_[v].add(-1, own[n][v]);
      }
      std::vector<double> looked(voxels_.size(), 0);
      for_each_root(nodes[n], [&](const SampleView& view, const Region& region) {
        TwinSample sample = evaluate(view, region, view.plan.range.begin);
        if (sample.weight <= 0) return;
        distribute(sample);
        add_sums(sample, looked);
        log_likelihood_ += sample.weight * std::log(std::max(sample.z, kLeast));
      });
      for (std::size_t v = 0; v < voxels_.size(); ++v) voxels_[v].looked += looked[v];
    }
    update();
  }

  /// The node sums of colour (capped at weight 1 a voxel); sets the totals.
  std::vector<std::vector<TwinColor>> collect_color(const std::vector<SampleNode>& nodes) {
    std::vector<std::vector<TwinColor>> own(nodes.size(), std::vector<TwinColor>(voxels_.size()));
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      for_each_root(nodes[n], [&](const SampleView& view, const Region& region) {
        deposit(view, region, view.plan.range.begin, 1, own[n]);
      });
      for (std::size_t v = 0; v < voxels_.size(); ++v) {
        TwinColor capped;
        if (own[n][v].weight > 0) capped.add(std::min(1.0, 1 / own[n][v].weight), own[n][v]);
        own[n][v] = capped;
        voxels_[v].color.add(1, capped);
      }
    }
    return own;
  }

  /// What samples are compared with from now on.
  void compare_with(std::vector<TwinColor> others) { others_ = std::move(others); }

  /// The sample and all that it divides into, with T, Z and likelihoods; weight 0 without valid pixels.
  TwinSample evaluate(const SampleView& view, const Region& region, double begin) const {
    TwinSample node;
    node.region = region;
    const RegionStats stats = view.pyramid->at(region.level, region.x, region.y);
    node.weight = static_cast<double>(stats.valid) * view.pixel_weight * std::ldexp(1.0, 2 * region.level);
    if (node.weight <= 0) return node;
    const Stretch range = served_range(view, region, begin);
    node.steps = steps_along(region_ray(view, region), range);
    for (TwinStep& step : node.steps) {
      const double tau = voxels_[step.cell].tau;
      step.a = 1 - std::exp(-tau * step.length);
      step.e = step.a > 1e-9 ? 1 / tau - step.length * (1 - step.a) / step.a : step.length / 2;
      step.p = likelihood(others_[step.cell], stats);
      node.likelihood += node.transmittance * step.a * step.p;
      node.transmittance *= 1 - step.a;
      node.path_sum += step.p;
    }
    double log_behind = 0, weight_behind = 0, best = 0;
    if (range.end < view.plan.range.end)
      for (int c = 0; c < 4; ++c) {
        if (!inside(view, region.child(c))) continue;
        TwinSample child = evaluate(view, region.child(c), std::max(range.begin, range.end));
        if (child.weight <= 0) continue;
        log_behind += child.weight * std::log(std::max(child.z, kLeast));
        weight_behind += child.weight;
        best = std::max(best, child.path_sum);
        node.children.push_back(std::move(child));
      }
    node.background_likelihood =
        twin_background(options_.opacity.background, options_.opacity.model, view.pyramid->masked(), stats);
    node.path_sum += node.children.empty() ? node.background_likelihood : best;
    node.z =
        node.likelihood + node.transmittance * (node.children.empty() ? node.background_likelihood
                                                                      : std::exp(log_behind / weight_behind));
    return node;
  }

  /// Sets r and reach of all steps and the background's share in the leaves.
  void distribute(TwinSample& root) const {
    if (options_.opacity.rule == UpdateRule::kPosterior) {
      distribute_posterior(root, 1);
    } else {
      distribute_roxels(root, root.path_sum, 0);
    }
  }

 private:
  static constexpr double kLeast =
      1e-30;  ///< likelihood of a sample that meets nothing and has no background

  template <class Visit>
  static void for_each_root(const SampleNode& node, Visit&& visit) {
    for (const SampleView& view : node) {
      const int level = view.plan.root_level;
      for (int y = 0; y < view.pyramid->height(level); ++y)
        for (int x = 0; x < view.pyramid->width(level); ++x) visit(view, Region{level, x, y});
    }
  }

  std::vector<TwinStep> steps_along(const Ray& ray, Stretch range) const {
    std::vector<TwinStep> steps;
    if (range.end <= range.begin) return steps;
    for (const TwinChord& chord : twin_chords({frame_}, ray, range))
      if (voxels_[cell(chord.ijk)].exists) steps.push_back({cell(chord.ijk), chord.length, chord.weight});
    return steps;
  }

  double likelihood(const TwinColor& color, const RegionStats& sample) const {
    const MatchModel& model = options_.opacity.model;
    const double w = std::max(color.weight, 0.0), w_0 = model.evidence_half;
    const double matched = w > 0 ? twin_agreement(model, color.mean() - twin_vector(sample.mean),
                                                  color.cov() + twin_matrix(sample.cov))
                                 : 0;
    const double mixed = w + w_0 > 0 ? (w * matched + w_0 * model.uninformative) / (w + w_0) : 0;
    return sample.foreground * mixed + model.outlier;
  }

  void deposit(const SampleView& view, const Region& region, double begin, double transmittance,
               std::vector<TwinColor>& sums) const {
    const RegionStats stats = view.pyramid->at(region.level, region.x, region.y);
    if (stats.valid <= 0) return;
    const double weight = static_cast<double>(stats.valid) * view.pixel_weight *
                          std::ldexp(1.0, 2 * region.level) * stats.foreground *
                          (1 - twin_known_share(options_.opacity.background, options_.opacity.model, stats));
    const Stretch range = served_range(view, region, begin);
    for (const TwinStep& step : steps_along(region_ray(view, region), range)) {
      const double a = 1 - std::exp(-voxels_[step.cell].tau * step.length);
      const double responsibility = options_.everywhere ? 1 : a * transmittance;
      sums[step.cell].add(responsibility * step.weight * weight, twin_vector(stats.mean),
                          twin_matrix(stats.cov));
      transmittance *= 1 - a;
    }
    if (range.end >= view.plan.range.end) return;
    for (int c = 0; c < 4; ++c)
      if (inside(view, region.child(c)))
        deposit(view, region.child(c), std::max(range.begin, range.end), transmittance, sums);
  }

  static void distribute_posterior(TwinSample& node, double q) {
    if (node.z <= 0) return;
    double transmittance = 1, reach = q;
    for (TwinStep& step : node.steps) {
      step.reach = reach;
      step.r = q * transmittance * step.a * step.p / node.z;
      reach -= step.r;
      transmittance *= 1 - step.a;
    }
    const double onward = q * (node.z - node.likelihood) / node.z;
    if (node.children.empty()) node.background = onward;
    for (TwinSample& child : node.children) distribute_posterior(child, onward);
  }

  static void distribute_roxels(TwinSample& node, double sum, double explained) {
    for (TwinStep& step : node.steps) {
      step.r = step.p / sum;
      step.reach = 1 - explained;
      explained += step.r;
    }
    if (node.children.empty()) node.background = node.background_likelihood / sum;
    for (TwinSample& child : node.children) distribute_roxels(child, sum, explained);
  }

  void add_sums(const TwinSample& node, std::vector<double>& looked) {
    for (const TwinStep& step : node.steps) {
      TwinVoxel& voxel = voxels_[step.cell];
      const double w = node.weight * (options_.opacity.ray_weights ? step.weight : 1);
      const bool posterior = options_.opacity.rule == UpdateRule::kPosterior;
      voxel.hits += w * step.r;
      voxel.exposure += w * (posterior ? (step.reach - step.r) * step.length + step.r * step.e
                                       : step.r * std::min(1.0, step.r / std::max(step.reach, 1e-6)));
      looked[step.cell] = std::max(looked[step.cell], step.reach * step.weight);
    }
    for (const TwinSample& child : node.children) add_sums(child, looked);
  }

  double alpha(const Eigen::Vector3i& at) const {
    if ((at.array() < 0).any() || (at.array() >= size_.array()).any() || !voxels_[cell(at)].exists) return 0;
    return 1 - std::exp(-voxels_[cell(at)].tau);
  }

  double prior_opacity(int of) const {
    std::vector<Eigen::Vector3i> steps;
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z)
          if (x || y || z) steps.emplace_back(x, y, z);
    double best = 0;
    for (const Eigen::Vector3i& normal : steps) {
      double sum = 0;
      int count = 0;
      for (const Eigen::Vector3i& step : steps)
        if (step.dot(normal) == 0) sum += alpha(ijk(of) + step), ++count;
      best = std::max(best, sum / count);
    }
    if (const double g = options_.prior.sharpness; g > 1) {
      const double odds = best / (1 - best) * (1 - kSharpenedAround) / kSharpenedAround;
      best = 1 - 1 / (1 + std::pow(odds, g));
    }
    return (1 - options_.prior.spatial_lambda) * options_.prior.opacity +
           options_.prior.spatial_lambda * best;
  }

  void update() {
    std::vector<double> tau(voxels_.size(), 0);
    for (int v = 0; v < static_cast<int>(voxels_.size()); ++v) {
      if (!voxels_[v].exists) continue;
      const double tau_0 = -std::log(1 - prior_opacity(v)), beta = options_.prior.strength;
      if (options_.opacity.rule == UpdateRule::kPosterior) {
        tau[v] = voxels_[v].exposure + beta > 0
                     ? (voxels_[v].hits + beta * tau_0) / (voxels_[v].exposure + beta)
                     : tau_0;
      } else {
        tau[v] = voxels_[v].hits > 1e-3
                     ? -std::log(1 - std::min(voxels_[v].exposure / voxels_[v].hits, 0.999999))
                     : tau_0;
      }
    }
    for (std::size_t v = 0; v < voxels_.size(); ++v) voxels_[v].tau = std::clamp(tau[v], 0.0, 16.0);
  }

  PassOptions options_;
  LatticeFrame frame_;
  Eigen::Vector3i size_;
  std::vector<TwinVoxel> voxels_;
  std::vector<TwinColor> others_;
  double log_likelihood_ = 0;
};

}  // namespace roxel
