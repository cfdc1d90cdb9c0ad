#include "roxel/io/colmap_dense.h"

#include <bit>
#include <cstring>
#include <fstream>
#include <map>

#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"
#include "roxel/base/formatted.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little);

constexpr std::int64_t kMostPixels = std::int64_t{1} << 31;

std::string image_name(const View& view, const fs::path& folder) {
  const fs::path name = fs::path(view.image_path).lexically_relative(fs::absolute(folder / "images"));
  if (name.empty() || name.generic_string().starts_with(".."))
    throw_invalid(view.image_path, "an image outside " + (folder / "images").string(),
                  "all images there, for COLMAP");
  return name.generic_string();
}

std::string camera_text(const View& view) {
  const Intrinsics& k = view.camera.intrinsics;
  if (k.skew != 0) throw_invalid(view.source, formatted("skew %g", k.skew), "none, for COLMAP");
  return formatted("PINHOLE %d %d %.17g %.17g %.17g %.17g", k.width, k.height, k.fx, k.fy, k.cx, k.cy);
}

std::string pose_text(const View& view) {
  const Eigen::Quaterniond q(view.camera.pose.rotation);
  const Eigen::Vector3d t = -view.camera.pose.rotation * view.camera.pose.centre;
  return formatted("%.17g %.17g %.17g %.17g %.17g %.17g %.17g", q.w(), q.x(), q.y(), q.z(), t.x(), t.y(),
                   t.z());
}

}  // namespace

void write_colmap_map(const fs::path& path, const Image& map) {
  const std::size_t pixels = static_cast<std::size_t>(map.width()) * map.height();
  std::string bytes = formatted("%d&%d&%d&", map.width(), map.height(), map.channels());
  std::vector<float> planes(map.data().size());
  for (int c = 0; c < map.channels(); ++c)
    for (std::size_t i = 0; i < pixels; ++i) planes[c * pixels + i] = map.data()[i * map.channels() + c];
  bytes.append(reinterpret_cast<const char*>(planes.data()), planes.size() * sizeof(float));
  fs::create_directories(path.parent_path());
  write_text_atomically(path, bytes);
}

Image read_colmap_map(const fs::path& path) {
  const char* expected = "WIDTH&HEIGHT&CHANNELS& and as many floats, as COLMAP writes";
  std::ifstream in(path, std::ios::binary);
  if (!in) throw_invalid(path.string(), "no such file", expected);
  std::int64_t size[3] = {0, 0, 0};
  for (std::int64_t& number : size) {
    char mark = 0;
    if (!(in >> number) || !in.get(mark) || mark != '&' || number < 1)
      throw_invalid(path.string(), "another beginning", expected);
  }
  if (size[0] > kMostPixels / size[1] || size[2] > 4)
    throw_invalid(path.string(), "a size that cannot be", expected);
  std::vector<float> planes(static_cast<std::size_t>(size[0] * size[1] * size[2]));
  const auto bytes = static_cast<std::streamsize>(planes.size() * sizeof(float));
  if (!in.read(reinterpret_cast<char*>(planes.data()), bytes))
    throw_invalid(path.string(), "too few floats", expected);
  if (in.peek() != std::ifstream::traits_type::eof())
    throw_invalid(path.string(), "bytes after the last float", expected);
  Image map(static_cast<int>(size[0]), static_cast<int>(size[1]), static_cast<int>(size[2]));
  const std::size_t pixels = static_cast<std::size_t>(size[0] * size[1]);
  for (int c = 0; c < map.channels(); ++c)
    for (std::size_t i = 0; i < pixels; ++i) map.data()[i * map.channels() + c] = planes[c * pixels + i];
  return map;
}

fs::path colmap_map_path(const fs::path& folder, const char* kind, const View& view) {
  return folder / "stereo" / (std::string(kind) + "_maps") / (image_name(view, folder) + ".geometric.bin");
}

void write_colmap_workspace(const Dataset& dataset, const std::vector<TrackedPoint>& points,
                            const fs::path& folder) {
  std::vector<std::string> sightings(dataset.views.size());
  std::vector<int> sighting_counts(dataset.views.size(), 0);
  std::string point_lines = "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n";
  int point_id = 0;
  for (const TrackedPoint& point : points) {
    const Eigen::Vector3d& x = point.position;
    point_lines += formatted("%d %.17g %.17g %.17g 128 128 128 0", ++point_id, x.x(), x.y(), x.z());
    for (const auto& [view, pixel] : point.sightings) {
      point_lines += formatted(" %d %d", view + 1, sighting_counts[view]++);
      sightings[view] += formatted("%.9g %.9g %d ", pixel.x(), pixel.y(), point_id);
    }
    point_lines += "\n";
  }
  std::map<std::string, int> camera_ids;
  std::string cameras = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  std::string images =
      "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME; then POINTS2D[] as (X, Y, POINT3D_ID)\n";
  std::string patch_match, fusion;
  for (std::size_t v = 0; v < dataset.views.size(); ++v) {
    const View& view = dataset.views[v];
    const std::string camera = camera_text(view), name = image_name(view, folder);
    const auto [entry, is_new] = camera_ids.emplace(camera, static_cast<int>(camera_ids.size()) + 1);
    if (is_new) cameras += formatted("%d ", entry->second) + camera + "\n";
    images += formatted("%d ", static_cast<int>(v) + 1) + pose_text(view) + formatted(" %d ", entry->second) +
              name + "\n" + sightings[v] + "\n";
    patch_match += name + "\n__auto__, 20\n";
    fusion += name + "\n";
  }
  fs::create_directories(folder / "sparse");
  fs::create_directories(folder / "stereo" / "consistency_graphs");
  write_text_atomically(folder / "sparse" / "cameras.txt", cameras);
  write_text_atomically(folder / "sparse" / "images.txt", images);
  write_text_atomically(folder / "sparse" / "points3D.txt", point_lines);
  write_text_atomically(folder / "stereo" / "patch-match.cfg", patch_match);
  write_text_atomically(folder / "stereo" / "fusion.cfg", fusion);
}

}  // namespace roxel
