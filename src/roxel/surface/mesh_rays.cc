#include "roxel/surface/mesh_rays.h"

#include <embree3/rtcore.h>

#include <limits>

#include "roxel/base/error.h"

namespace roxel {

struct MeshRays::State {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();

  ~State() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }

  void add(const Mesh& mesh) const {
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.points.size()));
    auto* corners = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangles.size()));
    if (!points || !corners) throw NumericalError("Embree has no memory for a surface");
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        points[3 * i + axis] = static_cast<float>(mesh.points[i][axis] - centre[axis]);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
      for (int k = 0; k < 3; ++k) corners[3 * i + k] = mesh.triangles[i][k];
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
  }

  RTCRay ray(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, float far) const {
    const Eigen::Vector3f from = (origin - centre).cast<float>(), along = direction.cast<float>();
    RTCRay ray{};
    ray.org_x = from.x(), ray.org_y = from.y(), ray.org_z = from.z();
    ray.dir_x = along.x(), ray.dir_y = along.y(), ray.dir_z = along.z();
    ray.tfar = far;
    ray.mask = ~0u;
    return ray;
  }
};

MeshRays::MeshRays(const Mesh& mesh) : state_(new State) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& x : mesh.points) box.extend(x);
  if (!box.isEmpty()) state_->centre = box.center();
  state_->device = rtcNewDevice(nullptr);
  if (!state_->device) throw NumericalError("Embree gives no device");
  state_->scene = rtcNewScene(state_->device);
  rtcSetSceneFlags(state_->scene, RTC_SCENE_FLAG_ROBUST);  // rays do not slip through edges
  if (!mesh.triangles.empty()) state_->add(mesh);
  rtcCommitScene(state_->scene);
  if (rtcGetDeviceError(state_->device) != RTC_ERROR_NONE)
    throw NumericalError("Embree cannot take in a surface");
}

MeshRays::~MeshRays() = default;

std::optional<MeshHit> MeshRays::trace(const Eigen::Vector3d& origin,
                                       const Eigen::Vector3d& direction) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray = state_->ray(origin, direction, std::numeric_limits<float>::infinity());
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(state_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  const double u = query.hit.u, v = query.hit.v;
  return MeshHit{query.ray.tfar, query.hit.primID, {1 - u - v, u, v}};
}

bool MeshRays::sees(const Eigen::Vector3d& eye, const Eigen::Vector3d& x, double margin) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray = state_->ray(eye, x - eye, static_cast<float>(1 - margin));
  rtcOccluded1(state_->scene, &context, &ray);
  return !(ray.tfar < 0);
}

}  // namespace roxel
