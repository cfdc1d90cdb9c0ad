#include "mesh_stage.h"

#include "roxel/base/error.h"
#include "roxel/io/depth_file.h"
#include "roxel/io/image_file.h"
#include "roxel/io/surface_ply.h"
#include "roxel/surface/depth_fusion.h"
#include "roxel/surface/surface_extraction.h"

namespace roxel::cli {
namespace {

namespace fs = std::filesystem;

constexpr float kHasDepth = 0.5f;  ///< opacity above which a pixel's depth counts

/// What the run's depth file says of a view: refined depth where there is some.
FusionView read_view(const fs::path& file, const View& view) {
  const std::vector<FloatChannel> channels = read_exr_channels(file.string());
  const auto channel = [&](const char* name) -> Image {
    const Image* found = find_channel(channels, name);
    return found ? *found : Image();
  };
  FusionView out{view.camera, channel("Z.refined"), channel("V.refined"), channel("A"), {}};
  if (out.depth.empty() || out.variance.empty()) {
    out.depth = channel("Z");
    out.variance = channel("V");
  }
  for (std::size_t i = 0; i < out.depth.data().size(); ++i)
    if (!(out.opacity.data()[i] > kHasDepth)) out.depth.data()[i] = 0;
  return out;
}

}  // namespace

void make_mesh(const MeshInput& input, const MeshOptions& options, const fs::path& results, Session& session) {
  FusionOptions fusion;
  fusion.voxel_size = options.voxel_size.value_or(input.volume.volume.index(0).frame().voxel_size / 2);
  fusion.box = input.box;
  fusion.band = options.band;
  fusion.least_sigma = options.least_sigma;
  const FusionViewLoader load = [&](int v) {
    const View& view = input.dataset.views[v];
    return read_view(depth_path(input.depth_run, view.name), view);
  };
  const DistanceField field =
      fuse_depth(static_cast<int>(input.dataset.views.size()), load, fusion, session.context());
  std::fprintf(stderr, "%ld samples %ld MiB\n", field.sample_count(), field.bytes() >> 20);
  Extraction extraction = extract_surface(field, {options.min_views, options.hole_size, options.smallest_part});
  std::fprintf(stderr, "%zu tri, unsupported %ld debris %ld\n", extraction.surface.mesh.triangles.size(),
               extraction.unsupported, extraction.debris);
  extraction.surface.normals = point_normals(extraction.surface.mesh);
  write_surface_ply(results / "mesh.ply", extraction.surface);
}

const OptionTable<MeshOptions>& mesh_option_table() {
  static const OptionTable<MeshOptions> table = [] {
    OptionTable<MeshOptions> t;
    t.group("Mesh");
    t.add("mesh-voxel-size", &MeshOptions::voxel_size).help("x").above(0).unset("half the volume's voxels");
    t.add("mesh-band", &MeshOptions::band).help("x").range(1.5, 16);
    t.add("mesh-least-sigma", &MeshOptions::least_sigma).help("x").range(0.01, 16);
    t.add("mesh-min-views", &MeshOptions::min_views).help("x").range(1, 1000);
    t.add("mesh-hole-size", &MeshOptions::hole_size).help("x").range(0, 1000);
    t.add("mesh-smallest-part", &MeshOptions::smallest_part).help("x").range(0, 1e9);
    return t;
  }();
  return table;
}

}  // namespace roxel::cli
