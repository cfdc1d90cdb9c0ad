#include "roxel/eval/surface_distance.h"

#include <embree3/rtcore.h>

#include <cmath>

#include "roxel/base/error.h"
#include "roxel/base/parallel.h"

namespace roxel {
namespace {

/// Embree prunes by boxes in floats; this much more than the nearest so far keeps rounding from pruning the
/// nearest of all.
constexpr double kSlack = 1 + 1e-5;

Eigen::Vector3d closest_on_segment(const Eigen::Vector3d& x, const Eigen::Vector3d& a,
                                   const Eigen::Vector3d& b) {
  const Eigen::Vector3d along = b - a;
  const double length_squared = along.squaredNorm();
  if (!(length_squared > 0)) return a;
  return a + std::clamp((x - a).dot(along) / length_squared, 0.0, 1.0) * along;
}

float below(double value) { return std::nextafter(static_cast<float>(value), -INFINITY); }
float above(double value) { return std::nextafter(static_cast<float>(value), INFINITY); }

}  // namespace

Eigen::Vector3d closest_on_triangle(const Eigen::Vector3d& x, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  // Inside the prism over the triangle it is the foot of the perpendicular; else it lies on an edge.
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const double squared = normal.squaredNorm();
  if (squared > 0) {
    const double u = (c - b).cross(x - b).dot(normal), v = (a - c).cross(x - c).dot(normal),
                 w = (b - a).cross(x - a).dot(normal);
    if (u >= 0 && v >= 0 && w >= 0) return x - (x - a).dot(normal) / squared * normal;
  }
  Eigen::Vector3d nearest = closest_on_segment(x, a, b);
  for (const Eigen::Vector3d& other : {closest_on_segment(x, b, c), closest_on_segment(x, c, a)})
    if ((other - x).squaredNorm() < (nearest - x).squaredNorm()) nearest = other;
  return nearest;
}

/// Points and triangles about a centre, so that Embree's floats are fine where coordinates are large.
struct SurfaceDistance::Scene {
  Mesh mesh;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  struct Query {
    const Scene* scene;
    Eigen::Vector3d x;
    double nearest;
  };

  std::size_t size() const { return mesh.is_point_set() ? mesh.points.size() : mesh.triangles.size(); }

  std::array<Eigen::Vector3d, 3> corners(std::size_t i) const {
    if (mesh.is_point_set()) return {mesh.points[i], mesh.points[i], mesh.points[i]};
    const auto& [a, b, c] = mesh.triangles[i];
    return {mesh.points[a], mesh.points[b], mesh.points[c]};
  }

  Eigen::Vector3d centre = Eigen::Vector3d::Zero();

  static void bounds(const RTCBoundsFunctionArguments* arguments) {
    const auto* self = static_cast<const Scene*>(arguments->geometryUserPtr);
    const auto corner = self->corners(arguments->primID);
    const Eigen::Vector3d low = corner[0].cwiseMin(corner[1]).cwiseMin(corner[2]),
                          high = corner[0].cwiseMax(corner[1]).cwiseMax(corner[2]);
    RTCBounds* box = arguments->bounds_o;
    box->lower_x = below(low.x());
    box->lower_y = below(low.y());
    box->lower_z = below(low.z());
    box->upper_x = above(high.x());
    box->upper_y = above(high.y());
    box->upper_z = above(high.z());
  }

  static bool visit(RTCPointQueryFunctionArguments* arguments) {
    auto* query = static_cast<Query*>(arguments->userPtr);
    const auto corner = query->scene->corners(arguments->primID);
    const double distance =
        (closest_on_triangle(query->x, corner[0], corner[1], corner[2]) - query->x).norm();
    if (!(distance < query->nearest)) return false;
    query->nearest = distance;
    arguments->query->radius = above(distance * kSlack);
    return true;
  }

  explicit Scene(Mesh taken) : mesh(std::move(taken)) {
    if (mesh.points.empty()) return;
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& x : mesh.points) box.extend(x);
    centre = box.center();
    for (Eigen::Vector3d& x : mesh.points) x -= centre;
    build();
  }

  void build() {
    device = rtcNewDevice(nullptr);
    if (!device) throw NumericalError("Embree gives no device");
    scene = rtcNewScene(device);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(size()));
    rtcSetGeometryUserData(geometry, this);
    rtcSetGeometryBoundsFunction(geometry, bounds, nullptr);
    rtcSetGeometryPointQueryFunction(geometry, visit);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE) throw NumericalError("Embree cannot take in a surface");
  }

  ~Scene() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
};

SurfaceDistance::SurfaceDistance(Mesh mesh) : scene_(std::make_unique<Scene>(std::move(mesh))) {}
SurfaceDistance::~SurfaceDistance() = default;
SurfaceDistance::SurfaceDistance(SurfaceDistance&&) noexcept = default;
SurfaceDistance& SurfaceDistance::operator=(SurfaceDistance&&) noexcept = default;

double SurfaceDistance::operator()(const Eigen::Vector3d& x, double limit) const {
  if (!scene_->scene) return std::numeric_limits<double>::infinity();
  Scene::Query query{scene_.get(), x - scene_->centre, limit};
  RTCPointQuery place;
  place.x = static_cast<float>(query.x.x());
  place.y = static_cast<float>(query.x.y());
  place.z = static_cast<float>(query.x.z());
  place.time = 0;
  place.radius = above(limit * kSlack);
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene_->scene, &place, &context, nullptr, &query);
  return query.nearest < limit ? query.nearest : std::numeric_limits<double>::infinity();
}

std::vector<double> SurfaceDistance::of(std::span<const Eigen::Vector3d> points, int threads) const {
  constexpr std::int64_t kGrain = 1024;
  std::vector<double> distances(points.size());
  parallel_for_blocks(static_cast<std::int64_t>(points.size()), kGrain, threads,
                      [&](std::int64_t begin, std::int64_t end, int) {
                        for (std::int64_t i = begin; i < end; ++i) distances[i] = (*this)(points[i]);
                      });
  return distances;
}

}  // namespace roxel
