#include "roxel/eval/surface_sight.h"

#include <embree3/rtcore.h>

#include "roxel/base/error.h"
#include "roxel/base/parallel.h"

namespace roxel {
namespace {

bool in_image(const PinholeCamera& camera, const Eigen::Vector3d& x) {
  const Eigen::Vector3d uvz = camera.project(x);
  return uvz.z() > 0 && uvz.x() >= 0 && uvz.x() < camera.intrinsics.width && uvz.y() >= 0 &&
         uvz.y() < camera.intrinsics.height;
}

/// The surface about its centre, in Embree's floats.
class Occluder {
 public:
  explicit Occluder(const Mesh& mesh) {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& x : mesh.points) box.extend(x);
    centre_ = box.isEmpty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(box.center());
    device_ = rtcNewDevice(nullptr);
    if (!device_) throw NumericalError("Embree gives no device");
    scene_ = rtcNewScene(device_);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    if (!mesh.triangles.empty()) add(mesh);
    rtcCommitScene(scene_);
    if (rtcGetDeviceError(device_) != RTC_ERROR_NONE) throw NumericalError("Embree cannot take in a surface");
  }
  ~Occluder() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  Occluder(const Occluder&) = delete;
  Occluder& operator=(const Occluder&) = delete;

  bool between(const Eigen::Vector3d& camera, const Eigen::Vector3d& x) const {
    const Eigen::Vector3f from = (camera - centre_).cast<float>(), along = (x - camera).cast<float>();
    RTCRay ray{};
    ray.org_x = from.x();
    ray.org_y = from.y();
    ray.org_z = from.z();
    ray.dir_x = along.x();
    ray.dir_y = along.y();
    ray.dir_z = along.z();
    ray.tfar = static_cast<float>(1 - kSightMargin);
    ray.mask = ~0u;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene_, &context, &ray);
    return ray.tfar < 0;
  }

 private:
  void add(const Mesh& mesh) {
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.points.size()));
    auto* corners = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangles.size()));
    if (!points || !corners) throw NumericalError("Embree has no memory for a surface");
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        points[3 * i + axis] = static_cast<float>(mesh.points[i][axis] - centre_[axis]);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
      for (int k = 0; k < 3; ++k) corners[3 * i + k] = mesh.triangles[i][k];
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
  }

  Eigen::Vector3d centre_;
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
};

}  // namespace

std::vector<int> count_sightings(const Mesh& surface, std::span<const Eigen::Vector3d> points,
                                 std::span<const PinholeCamera> cameras, int threads) {
  constexpr std::int64_t kGrain = 1024;
  const Occluder occluder(surface);
  std::vector<int> counts(points.size());
  parallel_for_blocks(static_cast<std::int64_t>(points.size()), kGrain, threads,
                      [&](std::int64_t begin, std::int64_t end, int) {
                        for (std::int64_t i = begin; i < end; ++i)
                          for (const PinholeCamera& camera : cameras)
                            counts[i] += in_image(camera, points[i]) &&
                                         !occluder.between(camera.pose.centre, points[i]);
                      });
  return counts;
}

}  // namespace roxel
