#include "roxel/synth/ray_scene.h"

#include <embree3/rtcore.h>

#include <cstring>
#include <limits>

#include "roxel/base/error.h"

namespace roxel {
namespace {

using Eigen::Vector3f;

/// Embree's own copy of a mesh's corners and triangles.
RTCGeometry make_geometry(RTCDevice device, const TriangleMesh& mesh) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           sizeof(Vector3f), mesh.vertices.size());
  void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            sizeof(mesh.triangles[0]), mesh.triangles.size());
  if (!vertices || !triangles) throw NumericalError("ray tracing: Embree has no memory for the mesh");
  std::memcpy(vertices, mesh.vertices.data(), mesh.vertices.size() * sizeof(Vector3f));
  std::memcpy(triangles, mesh.triangles.data(), mesh.triangles.size() * sizeof(mesh.triangles[0]));
  rtcCommitGeometry(geometry);
  return geometry;
}

RTCRay make_ray(const Vector3f& origin, const Vector3f& direction, float near, float far) {
  RTCRay ray{};
  ray.org_x = origin.x(), ray.org_y = origin.y(), ray.org_z = origin.z();
  ray.dir_x = direction.x(), ray.dir_y = direction.y(), ray.dir_z = direction.z();
  ray.tnear = near, ray.tfar = far;
  ray.mask = ~0u;
  return ray;
}

}  // namespace

struct RayScene::State {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  const std::vector<std::uint16_t> materials[2];

  void attach(const TriangleMesh& mesh, unsigned id) const {
    if (mesh.triangles.empty()) return;
    RTCGeometry geometry = make_geometry(device, mesh);
    rtcAttachGeometryByID(scene, geometry, id);
    rtcReleaseGeometry(geometry);
  }
  ~State() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
};

RayScene::RayScene(const TriangleMesh& mesh, const TriangleMesh& extra)
    : state_(new State{nullptr, nullptr, {mesh.materials, extra.materials}}) {
  // A number of threads here would be a limit on everyone's use of TBB.
  state_->device = rtcNewDevice(nullptr);
  if (!state_->device) throw NumericalError("ray tracing: Embree does not start");
  state_->scene = rtcNewScene(state_->device);
  rtcSetSceneFlags(state_->scene, RTC_SCENE_FLAG_ROBUST);  // rays do not slip through edges
  state_->attach(mesh, 0);
  state_->attach(extra, 1);
  rtcCommitScene(state_->scene);
  if (rtcGetDeviceError(state_->device) != RTC_ERROR_NONE)
    throw NumericalError("ray tracing: Embree cannot build its tree of " +
                         std::to_string(mesh.triangles.size()) + " triangles");
}

RayScene::~RayScene() = default;

std::optional<RayHit> RayScene::trace(const Vector3f& origin, const Vector3f& direction, float near) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  query.ray = make_ray(origin, direction, near, std::numeric_limits<float>::infinity());
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(state_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  Vector3f normal = Vector3f(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z).normalized();
  if (normal.dot(direction) > 0) normal = -normal;
  const bool extra = query.hit.geomID == 1;
  return RayHit{query.ray.tfar, normal, state_->materials[extra][query.hit.primID], extra};
}

bool RayScene::occluded(const Vector3f& origin, const Vector3f& direction, float near, float far) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray = make_ray(origin, direction, near, far);
  rtcOccluded1(state_->scene, &context, &ray);
  return ray.tfar < 0;
}

}  // namespace roxel
