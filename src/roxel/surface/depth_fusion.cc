#include "roxel/surface/depth_fusion.h"

#include <openvdb/tools/Morphology.h>
#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <span>

#include "roxel/base/error.h"
#include "roxel/base/parallel.h"
#include "roxel/surface/distance_voxels.inl"

namespace roxel {
namespace {

using Eigen::Vector3d;
using openvdb::Coord;
using MaskTree = openvdb::MaskTree;
using Leaf = openvdb::FloatTree::LeafNodeType;

constexpr std::int64_t kPixelsAtOnce = 96'000'000;  ///< of views that are in memory together
constexpr std::int64_t kViewsShare = 4;  ///< one part in so many of the memory is theirs, if they need that
constexpr std::int64_t kBytesPerPixel = 8;  ///< of a view that is ready
/// Of one that is being read: the layers of its file, and what is made of them.
constexpr std::int64_t kBytesPerPixelRead = 16 * sizeof(float);
constexpr float kLeastCosine = 0.2f;  ///< of the angle between ray and normal: steeper depth says no less
constexpr float kUnknownCosine = 0.7f;
constexpr float kSupport = 2.5f;  ///< steps from its surface within which a view supports one
constexpr float kLeastSupportCosine =
    0.5f;                               ///< views that see a surface at a flatter angle support less of it
constexpr double kFarthestOutline = 4;  ///< pixels
constexpr std::int64_t kBytesPerLeaf = 7 * (Leaf::SIZE * sizeof(float) + 128);  ///< with the sums of a vote

/// What a pixel's depth counts, in four bytes.
class Facing {
 public:
  Facing() = default;
  Facing(float weight, float cosine)
      : weight_(static_cast<std::uint16_t>((std::bit_cast<std::uint32_t>(weight) + 0x8000u) >> 16)),
        cosine_(static_cast<std::uint16_t>(std::min(cosine * kUnit + 0.5f, 65535.0f))) {}
  /// To 8 bits.
  float weight() const { return std::bit_cast<float>(static_cast<std::uint32_t>(weight_) << 16); }
  /// That turns a distance along the axis into one along the normal.
  float cosine() const { return static_cast<float>(cosine_) * (1 / kUnit); }

 private:
  /// Directions are longer than 1 off the axis, and so is their cosine: up to 86 degrees off.
  static constexpr float kUnit = 1 << 12;
  std::uint16_t weight_ = 0, cosine_ = 0;
};
static_assert(sizeof(float) + sizeof(Facing) == kBytesPerPixel);

/// A view ready to be asked.
struct PreparedView {
  static constexpr float kFree = -1;  ///< the ray sees nothing in the box

  PinholeCamera camera;
  Image depth;  ///< along the axis; kFree, or 0 where nothing is known
  std::vector<Facing> facing;
  Eigen::Matrix<double, 3, 4> from_world;  ///< homogeneous pixel position; its z is the depth
  float continuous = 0;                    ///< neighbours whose depths differ by less lie on one surface

  /// Of blocks of kBlock x kBlock pixels: the smallest depth, not above 0 where a pixel has none, and the
  /// largest.
  static constexpr int kBlock = 8;
  Image nearest = {}, farthest = {};

  /// (u, v, depth) of a point.
  Vector3d project(const Vector3d& x) const {
    const Vector3d h = from_world.leftCols<3>() * x + from_world.col(3);
    return {h.x() / h.z(), h.y() / h.z(), h.z()};
  }
  Facing& facing_of(int x, int y) { return facing[static_cast<std::size_t>(y) * depth.width() + x]; }
  const Facing& facing_of(int x, int y) const {
    return facing[static_cast<std::size_t>(y) * depth.width() + x];
  }
  bool has(int x, int y) const {
    return x >= 0 && y >= 0 && x < depth.width() && y < depth.height() && *depth.pixel(x, y) > 0;
  }
};

Vector3d pixel_point(const PreparedView& view, int x, int y) {
  const Ray ray = view.camera.ray(x + 0.5, y + 0.5);
  return ray.origin + *view.depth.pixel(x, y) * ray.direction;
}

/// Of the surface through the pixel's neighbours, two pixels away so that noise weighs less; zero where there
/// are none on both sides.
Vector3d normal_from_depth(const PreparedView& view, int x, int y) {
  constexpr int kStep = 2;
  const auto joined = [&](int ax, int ay) {
    return view.has(ax, ay) &&
           std::abs(*view.depth.pixel(ax, ay) - *view.depth.pixel(x, y)) < view.continuous;
  };
  if (!joined(x - kStep, y) || !joined(x + kStep, y) || !joined(x, y - kStep) || !joined(x, y + kStep))
    return Vector3d::Zero();
  const Vector3d across = pixel_point(view, x + kStep, y) - pixel_point(view, x - kStep, y);
  const Vector3d down = pixel_point(view, x, y + kStep) - pixel_point(view, x, y - kStep);
  return across.cross(down).normalized();
}

float axis_to_normal(const PreparedView& view, const Image& normals, int x, int y) {
  const Ray ray = view.camera.ray(x + 0.5, y + 0.5);
  Vector3d normal = Vector3d::Zero();
  if (!normals.empty()) {
    const float* n = normals.pixel(x, y);
    normal = Vector3d(n[0], n[1], n[2]);
  }
  if (!(normal.squaredNorm() > 0.25)) normal = normal_from_depth(view, x, y);
  if (!(normal.squaredNorm() > 0.25)) return kUnknownCosine;
  // |direction| is what one unit along the axis is along the ray.
  return std::max(kLeastCosine, static_cast<float>(std::abs(normal.dot(ray.direction))));
}

bool is_depth(float z, float variance) {
  return z > 0 && std::isfinite(z) && variance >= 0 && std::isfinite(variance);
}

/// Smallest and largest depth of each block.
void summarise_blocks(PreparedView& view) {
  constexpr int kBlock = PreparedView::kBlock;
  const int width = view.depth.width(), height = view.depth.height();
  const int columns = (width + kBlock - 1) / kBlock, rows = (height + kBlock - 1) / kBlock;
  view.nearest = Image(columns, rows, 1, std::numeric_limits<float>::infinity());
  view.farthest = Image(columns, rows, 1);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float z = *view.depth.pixel(x, y);
      float& nearest = *view.nearest.pixel(x / kBlock, y / kBlock);
      float& farthest = *view.farthest.pixel(x / kBlock, y / kBlock);
      nearest = std::min(nearest, z);
      farthest = std::max(farthest, z);
    }
}

/// Whether a view can say anything of a ball at x: not where it lies outside the image, or more than `band`
/// behind all that the view sees there.
bool may_say(const PreparedView& view, const Vector3d& x, double radius, double band) {
  const Vector3d uvz = view.project(x);
  const double front = uvz.z() - radius;
  if (!(front > 0)) return uvz.z() + radius > 0;
  const Intrinsics& k = view.camera.intrinsics;
  // A ball's image reaches no farther than this from its centre's: radius over depth, more off the axis.
  const double off = std::hypot((uvz.x() - k.cx) / k.fx, (uvz.y() - k.cy) / k.fy);
  const double reach = (std::max(k.fx, k.fy) + std::abs(k.skew)) * radius / front * (1 + off) + 1;
  const double u0 = uvz.x() - reach, u1 = uvz.x() + reach, v0 = uvz.y() - reach, v1 = uvz.y() + reach;
  if (u1 < 0 || v1 < 0 || u0 >= view.depth.width() || v0 >= view.depth.height()) return false;
  const auto block = [](double at, int count) {
    return static_cast<int>(std::clamp(at / PreparedView::kBlock, 0.0, count - 1.0));
  };
  const int columns = view.nearest.width(), rows = view.nearest.height();
  for (int y = block(std::max(v0, 0.0), rows); y <= block(v1, rows); ++y)
    for (int column = block(std::max(u0, 0.0), columns); column <= block(u1, columns); ++column)
      if (!(*view.nearest.pixel(column, y) > 0) || *view.farthest.pixel(column, y) + band >= front)
        return true;
  return false;
}

Eigen::Matrix<double, 3, 4> pixel_from_world(const PinholeCamera& camera) {
  const Intrinsics& k = camera.intrinsics;
  Eigen::Matrix3d pixels;
  pixels << k.fx, k.skew, k.cx, 0, k.fy, k.cy, 0, 0, 1;
  Eigen::Matrix<double, 3, 4> from_world;
  from_world << pixels * camera.pose.rotation, -pixels * camera.pose.rotation * camera.pose.centre;
  return from_world;
}

PreparedView prepare(FusionView view, const FusionOptions& options) {
  const int width = view.depth.width(), height = view.depth.height();
  ROXEL_CHECK_EQ(width, view.camera.intrinsics.width);
  ROXEL_CHECK_EQ(height, view.camera.intrinsics.height);
  ROXEL_CHECK_EQ(view.variance.data().size(), view.depth.data().size());
  PreparedView out{view.camera, std::move(view.depth), std::vector<Facing>(view.variance.data().size()),
                   pixel_from_world(view.camera), static_cast<float>(options.band * options.voxel_size)};
  const float least = static_cast<float>(options.least_sigma * options.voxel_size);
  for (std::size_t i = 0; i < out.facing.size(); ++i) {
    float& z = out.depth.data()[i];
    if (is_depth(z, view.variance.data()[i])) continue;
    const float opacity = view.opacity.empty() ? 1.0f : view.opacity.data()[i];
    z = opacity < options.free_opacity ? PreparedView::kFree : 0.0f;
  }
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (!out.has(x, y)) continue;
      const float cosine = axis_to_normal(out, view.normal, x, y);
      out.facing_of(x, y) = {1 / (cosine * cosine * *view.variance.pixel(x, y) + least * least), cosine};
    }
  summarise_blocks(out);
  return out;
}

/// What a view says of one place.
struct Vote {
  float distance = 0;  ///< in front of its surface, world units, at most the band
  float weight = 0;    ///< 0: it says nothing
  bool near = false;   ///< its surface is close by
};

/// What views that see a surface at a place say of it, beside those that say it is free: by how much they
/// differ.
struct Spread {
  openvdb::FloatTree::Ptr weight, first, second, count;
  explicit Spread(const MaskTree& places) {
    for (openvdb::FloatTree::Ptr* tree : {&weight, &first, &second, &count}) {
      *tree = make_tree<openvdb::FloatGrid>();
      (*tree)->topologyUnion(places);
    }
  }
};

/// Of one leaf.
struct SpreadSums {
  float *weight, *first, *second, *count;
  void add(openvdb::Index n, float w, float distance) const {
    weight[n] += w;
    first[n] += w * distance;
    second[n] += w * distance * distance;
    count[n] += 1;
  }
  /// By how much more the views differ than their variances say, at least 1.
  float chi2(openvdb::Index n) const {
    if (count[n] < 2) return 1;
    return std::max(1.0f, (second[n] - first[n] * first[n] / weight[n]) / (count[n] - 1));
  }
};

/// floor(u) of u > -16; std::floor is a call where the machine has no instruction for it.
int below(double u) { return static_cast<int>(u + 16) - 16; }

/// Depth between the four pixels around (u, v), or of the nearest one where they are not on one surface.
float depth_at(const PreparedView& view, double u, double v) {
  const float nearest = *view.depth.pixel(static_cast<int>(u), static_cast<int>(v));
  const int x = below(u - 0.5), y = below(v - 0.5);
  if (!view.has(x, y) || !view.has(x + 1, y) || !view.has(x, y + 1) || !view.has(x + 1, y + 1))
    return nearest;
  const float a = *view.depth.pixel(x, y), b = *view.depth.pixel(x + 1, y), c = *view.depth.pixel(x, y + 1),
              d = *view.depth.pixel(x + 1, y + 1);
  const float low = std::min(std::min(a, b), std::min(c, d)), high = std::max(std::max(a, b), std::max(c, d));
  if (high - low > view.continuous) return nearest;
  const float s = static_cast<float>(u - 0.5 - x), t = static_cast<float>(v - 0.5 - y);
  return (1 - t) * ((1 - s) * a + s * b) + t * ((1 - s) * c + s * d);
}

class Voting {
 public:
  explicit Voting(const FusionOptions& options)
      : band_(static_cast<float>(options.band * options.voxel_size)),
        support_(static_cast<float>(kSupport * options.voxel_size)),
        voxel_size_(options.voxel_size),
        free_weight_(static_cast<float>(1 / (options.voxel_size * options.voxel_size))) {}

  Vote operator()(const PreparedView& view, const Vector3d& x) const {
    const Vector3d uvz = view.project(x);
    if (!(uvz.z() > 0 && uvz.x() >= 0 && uvz.y() >= 0 && uvz.x() < view.depth.width() &&
          uvz.y() < view.depth.height()))
      return {};
    const int px = static_cast<int>(uvz.x()), py = static_cast<int>(uvz.y());
    if (!view.has(px, py)) return without_depth(view, uvz);
    const float z = depth_at(view, uvz.x(), uvz.y());
    const float along = z - static_cast<float>(uvz.z()), scale = view.facing_of(px, py).cosine();
    if (along < -band_) return {};  // hidden; not by the normal, or outlines would throw long shadows
    const float distance = along * scale;
    if (distance >= band_ && beside_surface(view, uvz)) return {};
    return {std::min(distance, band_), view.facing_of(px, py).weight() * scale * behind(along),
            std::abs(along) * std::max(scale, kLeastSupportCosine) < support_};
  }

 private:
  /// Whether the outline of a surface at this depth passes within a step: then a ray that is free says
  /// nothing of how far away it is, and thin things would be worn off by all that see past them.
  bool beside_surface(const PreparedView& view, const Vector3d& uvz) const {
    const double step = std::clamp(voxel_size_ * view.camera.intrinsics.fx / uvz.z(), 1.0, kFarthestOutline);
    const auto near = [&](double u, double v) {
      const int x = below(u), y = below(v);
      return view.has(x, y) && std::abs(*view.depth.pixel(x, y) - static_cast<float>(uvz.z())) < band_;
    };
    return near(uvz.x() - step, uvz.y()) || near(uvz.x() + step, uvz.y()) || near(uvz.x(), uvz.y() - step) ||
           near(uvz.x(), uvz.y() + step);
  }

  Vote without_depth(const PreparedView& view, const Vector3d& uvz) const {
    const bool free = *view.depth.pixel(static_cast<int>(uvz.x()), static_cast<int>(uvz.y())) < 0;
    if (!free || beside_surface(view, uvz)) return {};
    return {band_, free_weight_, false};
  }

  /// Behind a surface a view knows less and less, so that thin things keep both of their sides.
  float behind(float distance) const {
    const float flat = -band_ / 3;
    return distance > flat ? 1.0f : (distance + band_) / (flat + band_);
  }

  float band_, support_;
  double voxel_size_;
  float free_weight_;
};

class Fusion {
 public:
  Fusion(int view_count, const FusionViewLoader& load, const FusionOptions& options, RunContext& context)
      : view_count_(view_count),
        load_(load),
        options_(options),
        context_(context),
        voxels_(std::make_unique<DistanceField::Voxels>()) {
    voxels_->origin = options.box.min();
    voxels_->voxel_size = options.voxel_size;
    voxels_->band = options.band * options.voxel_size;
  }

  DistanceField make() {
    find_places();
    gather_votes();
    smooth_distance(*voxels_, options_.smooth, context_.thread_count());
    fill_unseen(*voxels_, options_.hole_size, options_.most_bytes, context_.thread_count());
    return DistanceField(std::move(voxels_));
  }

 private:
  /// Calls visit(prepared views of a batch) for one batch after the other, in the order of views. No result
  /// depends on how many they are. One batch of all views stays for the next time.
  template <class Visit>
  void for_each_batch(const Visit& visit) {
    if (!all_views_.empty()) return visit(all_views_);
    const std::int64_t most_pixels =
        std::min(kPixelsAtOnce, options_.most_bytes / (kViewsShare * kBytesPerPixel));
    for (int begin = 0; begin < view_count_;) {
      std::vector<PreparedView> batch;
      std::int64_t pixels = 0;
      while (begin < view_count_ && (batch.empty() || pixels < most_pixels)) {
        const int count = std::min(view_count_ - begin, context_.thread_count());
        const std::size_t first = batch.size();
        batch.resize(first + count);
        parallel_for(count, context_.thread_count(), [&](std::int64_t i, int) {
          context_.throw_if_cancelled();
          batch[first + i] = prepare(load_(begin + static_cast<int>(i)), options_);
        });
        for (int i = 0; i < count; ++i) {
          const auto size = static_cast<std::int64_t>(batch[first + i].depth.data().size());
          pixels += size;
          largest_view_ = std::max(largest_view_, size);
        }
        begin += count;
      }
      largest_batch_ = std::max(largest_batch_, pixels);
      visit(batch);
      if (std::ssize(batch) == view_count_) all_views_ = std::move(batch);
    }
  }

  /// The corners of the lattice near a depth of any view.
  void find_places() {
    const MaskTree::Ptr made = make_tree<openvdb::MaskGrid>();
    MaskTree& places = *made;
    for_each_batch([&](const std::vector<PreparedView>& batch) {
      std::vector<MaskTree::Ptr> of_view(batch.size());
      for (MaskTree::Ptr& mask : of_view) mask = make_tree<openvdb::MaskGrid>();
      parallel_for(static_cast<std::int64_t>(batch.size()), context_.thread_count(),
                   [&](std::int64_t v, int) {
                     context_.throw_if_cancelled();
                     mark(batch[v], *of_view[v]);
                   });
      for (const MaskTree::Ptr& mask : of_view) places.topologyUnion(*mask);
    });
    if (places.empty()) throw NoSurface("no view has depth in the box: there is no surface to make");
    openvdb::tools::dilateActiveValues(
        places, static_cast<int>(std::ceil(options_.band)), openvdb::tools::NN_FACE_EDGE_VERTEX,
        openvdb::tools::IGNORE_TILES);  // others would make tiles of full leaves
    check_size(places);
    voxels_->distance = make_tree<openvdb::FloatGrid>(static_cast<float>(voxels_->band));
    voxels_->weight = make_tree<openvdb::FloatGrid>();
    voxels_->views = make_tree<openvdb::FloatGrid>();
    for (const auto& tree : {voxels_->distance, voxels_->weight, voxels_->views}) tree->topologyUnion(places);
    spread_.emplace(places);
  }

  void mark(const PreparedView& view, MaskTree& places) const {
    openvdb::tree::ValueAccessor<MaskTree> accessor(places);
    for (int y = 0; y < view.depth.height(); ++y)
      for (int x = 0; x < view.depth.width(); ++x) {
        if (!view.has(x, y)) continue;
        const Vector3d point = pixel_point(view, x, y);
        if (!options_.box.contains(point)) continue;
        const Vector3d ijk = (point - voxels_->origin) / voxels_->voxel_size;
        accessor.setValueOn(Coord::round(openvdb::Vec3d(ijk.x(), ijk.y(), ijk.z())));
      }
  }

  void check_size(const MaskTree& places) const {
    const std::int64_t leaves = static_cast<std::int64_t>(places.leafCount());
    const std::int64_t later = lattice_bytes(leaves, static_cast<std::int64_t>(places.activeVoxelCount()));
    const std::int64_t views =
        largest_batch_ * kBytesPerPixel +
        std::min(context_.thread_count(), view_count_) * largest_view_ * kBytesPerPixelRead;
    check_lattice_bytes(std::max(leaves * kBytesPerLeaf + views, later), options_.most_bytes,
                        options_.voxel_size);
  }

  void gather_votes() {
    using Manager = openvdb::tree::LeafManager<openvdb::FloatTree>;
    const Manager distance(*voxels_->distance), weight(*voxels_->weight), views(*voxels_->views);
    const Manager spread[4]{Manager(*spread_->weight), Manager(*spread_->first), Manager(*spread_->second),
                            Manager(*spread_->count)};
    const auto spread_of = [&](std::int64_t i) {
      const auto data = [&](int k) { return spread[k].leaf(i).buffer().data(); };
      return SpreadSums{data(0), data(1), data(2), data(3)};
    };
    const std::int64_t leaves = static_cast<std::int64_t>(distance.leafCount());
    parallel_for(leaves, context_.thread_count(),
                 [&](std::int64_t i, int) { distance.leaf(i).buffer().fill(0); });
    const Voting vote(options_);
    for_each_batch([&](const std::vector<PreparedView>& batch) {
      parallel_for(leaves, context_.thread_count(), [&](std::int64_t i, int) {
        if (i % 64 == 0) context_.throw_if_cancelled();
        add_votes(batch, vote, distance.leaf(i), weight.leaf(i), views.leaf(i), spread_of(i));
      });
    });
    parallel_for(leaves, context_.thread_count(), [&](std::int64_t i, int) {
      float* sums = distance.leaf(i).buffer().data();
      float* weights = weight.leaf(i).buffer().data();
      const SpreadSums spread_sums = spread_of(i);
      for (openvdb::Index v = 0; v < Leaf::SIZE; ++v) {
        sums[v] = weights[v] > 0 ? sums[v] / weights[v] : static_cast<float>(voxels_->band);
        weights[v] /= spread_sums.chi2(v);
      }
    });
    spread_.reset();
    all_views_ = {};
  }

  void add_votes(const std::vector<PreparedView>& batch, const Voting& vote, Leaf& distance, Leaf& weight,
                 Leaf& views, const SpreadSums& spread) const {
    float* distances = distance.buffer().data();
    float* weights = weight.buffer().data();
    float* counts = views.buffer().data();
    constexpr double kMiddle = 0.5 * (Leaf::DIM - 1);
    const Vector3d corner = voxels_->position(distance.origin());
    const Vector3d middle = corner + Vector3d::Constant(kMiddle * voxels_->voxel_size);
    const double radius = std::sqrt(3.0) * kMiddle * voxels_->voxel_size;
    struct Place {
      openvdb::Index n;
      Vector3d x;
    };
    std::array<Place, Leaf::SIZE> places;
    std::size_t count = 0;
    for (auto it = distance.cbeginValueOn(); it; ++it)
      places[count++] = {it.pos(), voxels_->position(it.getCoord())};
    // View by view: what a view shows of a leaf is close together.
    for (const PreparedView& view : batch) {
      if (!may_say(view, middle, radius, voxels_->band)) continue;
      for (const Place& place : std::span(places).first(count)) {
        const Vote said = vote(view, place.x);
        distances[place.n] += said.weight * said.distance;
        weights[place.n] += said.weight;
        counts[place.n] += said.near;
        if (said.weight > 0 && said.distance < static_cast<float>(voxels_->band))
          spread.add(place.n, said.weight, said.distance);
      }
    }
  }

  int view_count_;
  const FusionViewLoader& load_;
  const FusionOptions& options_;
  RunContext& context_;
  std::unique_ptr<DistanceField::Voxels> voxels_;
  std::optional<Spread> spread_;
  std::vector<PreparedView> all_views_;
  std::int64_t largest_batch_ = 0, largest_view_ = 0;  ///< pixels
};

}  // namespace

DistanceField::DistanceField(std::unique_ptr<Voxels> voxels) : voxels_(std::move(voxels)) {}
DistanceField::DistanceField(DistanceField&&) noexcept = default;
DistanceField& DistanceField::operator=(DistanceField&&) noexcept = default;
DistanceField::~DistanceField() = default;

std::optional<DistanceField::Sample> DistanceField::at(const Vector3d& x) const {
  const Vector3d at = (x - voxels_->origin) / voxels_->voxel_size;
  const Coord ijk = Coord::round(openvdb::Vec3d(at.x(), at.y(), at.z()));
  if (!voxels_->distance->isValueOn(ijk)) return {};
  return Sample{voxels_->distance->getValue(ijk), voxels_->weight->getValue(ijk),
                static_cast<int>(voxels_->views->getValue(ijk))};
}

std::int64_t DistanceField::sample_count() const {
  return static_cast<std::int64_t>(voxels_->distance->activeVoxelCount());
}

std::int64_t DistanceField::bytes() const {
  return static_cast<std::int64_t>(voxels_->distance->memUsage() + voxels_->weight->memUsage() +
                                   voxels_->views->memUsage());
}

double DistanceField::voxel_size() const { return voxels_->voxel_size; }

DistanceField fuse_depth(int view_count, const FusionViewLoader& load, const FusionOptions& options,
                         RunContext& context) {
  ROXEL_CHECK(options.voxel_size > 0);
  ROXEL_CHECK(options.band >= 1);
  ROXEL_CHECK(!options.box.isEmpty());
  return Fusion(view_count, load, options, context).make();
}

}  // namespace roxel
