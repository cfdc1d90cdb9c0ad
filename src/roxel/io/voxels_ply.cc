#include "roxel/io/voxels_ply.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>

#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"

namespace roxel {
namespace {

static_assert(std::endian::native == std::endian::little, "rows are written as they lie in memory");

constexpr int kRowBytes = 3 * 4 + 3 + 4;

std::uint8_t byte_of(float linear) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(srgb_encode(linear), 0.0f, 1.0f)));
}

void append_row(const Eigen::Vector3d& centre, const float color[3], const ColorTransform& colors,
                float alpha, std::vector<char>& rows) {
  float rgb[3];
  colors.to_rgb(color, rgb);
  const Eigen::Vector3f x = centre.cast<float>();
  const std::uint8_t bytes[3] = {byte_of(rgb[0]), byte_of(rgb[1]), byte_of(rgb[2])};
  char row[kRowBytes];
  std::memcpy(row, x.data(), 12);
  std::memcpy(row + 12, bytes, 3);
  std::memcpy(row + 15, &alpha, 4);
  rows.insert(rows.end(), row, row + kRowBytes);
}

std::vector<char> rows_of(const Volume& volume, const ColorTransform& colors, float opacity_threshold,
                          float confidence_threshold) {
  std::vector<char> rows;
  if (volume.lattice_count() == 0) return rows;
  const BrickIndex& index = volume.index(0);
  for (const Brick& brick : index.bricks())
    for (int v = 0; v < kBrickVoxels; ++v) {
      if (brick.local[v] == kNoVoxel) continue;
      const std::uint32_t slot = brick.first_slot + brick.local[v];
      const float alpha = alpha_from_tau(volume.tau[slot]);
      if (!(alpha >= opacity_threshold && volume.confidence[slot] >= confidence_threshold)) continue;
      const Eigen::Vector3i in_brick(v % kBrickSide, v / kBrickSide % kBrickSide,
                                     v / (kBrickSide * kBrickSide));
      append_row(index.frame().voxel_centre(kBrickSide * brick.coord + in_brick),
                 volume.color_mean[slot].data(), colors, alpha, rows);
    }
  return rows;
}

}  // namespace

std::int64_t write_voxels_ply(const std::filesystem::path& path, const Volume& volume,
                              const ColorTransform& colors, float opacity_threshold,
                              float confidence_threshold) {
  const std::vector<char> rows = rows_of(volume, colors, opacity_threshold, confidence_threshold);
  const std::int64_t count = static_cast<std::int64_t>(rows.size() / kRowBytes);
  write_file_atomically(path, [&](const std::filesystem::path& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    file << "ply\nformat binary_little_endian 1.0\ncomment roxel: voxels as points\nelement vertex " << count
         << "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar "
            "green\n"
            "property uchar blue\nproperty float opacity\nend_header\n";
    file.write(rows.data(), static_cast<std::streamsize>(rows.size()));
    if (!file.flush()) throw IoError(path.string() + ": cannot write (disc full?)");
  });
  return count;
}

}  // namespace roxel
