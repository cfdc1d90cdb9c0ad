#include "roxel/io/voxels_ply.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>

#include "roxel/base/atomic_file.h"
#include "roxel/base/error.h"
#include "roxel/volume/saved_voxels.h"
#include "roxel/volume/shown_color.h"

namespace roxel {
namespace {

static_assert(std::endian::native == std::endian::little, "rows are written as they lie in memory");

constexpr int kRowBytes = 3 * 4 + 3 + 4;

std::uint8_t srgb_byte(float linear) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(srgb_encode(linear), 0.0f, 1.0f)));
}

void append_row(const Eigen::Vector3d& centre, const std::array<float, 3>& rgb, float alpha,
                std::vector<char>& rows) {
  const Eigen::Vector3f x = centre.cast<float>();
  const std::uint8_t bytes[3] = {srgb_byte(rgb[0]), srgb_byte(rgb[1]), srgb_byte(rgb[2])};
  char row[kRowBytes];
  std::memcpy(row, x.data(), 12);
  std::memcpy(row + 12, bytes, 3);
  std::memcpy(row + 15, &alpha, 4);
  rows.insert(rows.end(), row, row + kRowBytes);
}

std::vector<char> rows_of(const Volume& volume, const ColorTransform& colors, float opacity_threshold,
                          float confidence_threshold) {
  std::vector<char> rows;
  for_each_saved_voxel(volume, opacity_threshold, confidence_threshold,
                       [&](std::uint32_t slot, const Eigen::Vector3d& centre, float opacity) {
                         append_row(centre, shown_color(volume, colors, slot), opacity, rows);
                       });
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
