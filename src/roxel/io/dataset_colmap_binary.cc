#include <cmath>
#include <cstring>

#include "roxel/base/error.h"
#include "roxel/io/dataset_camera.h"
#include "roxel/io/dataset_colmap.h"
#include "roxel/io/dataset_text.h"

// Little-endian, packed, each file a uint64 count and then that many records:
//   cameras.bin   int32 id | int32 model | uint64 width | uint64 height | double parameters[]
//   images.bin    int32 id | double qw qx qy qz | double tx ty tz | int32 camera id | name '\0'
//                 | uint64 n | n x (double x | double y | int64 point id)
//   points3D.bin  uint64 id | double x y z | uint8 r g b | double error | uint64 n | n x (int32 image | int32
//   idx)

namespace roxel {
namespace {

namespace fs = std::filesystem;

static_assert(sizeof(double) == 8 && sizeof(int) == 4);

/// Reads plain values one after the other; running past the end is the caller's file being truncated.
class ByteReader {
 public:
  explicit ByteReader(const fs::path& file) : file_(file), content_(read_whole_file(file)) {
    if (const std::string kind = kind_of_content(content_); kind != "binary data") {
      throw_invalid(file.string(), kind, "COLMAP's binary format (text belongs into .txt files)");
    }
  }

  template <class T>
  T read(const std::string& field) {
    need(sizeof(T), field);
    T value;
    std::memcpy(&value, content_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }

  double read_finite(const std::string& field) {
    const double value = read<double>(field);
    if (!std::isfinite(value))
      throw_invalid(file_.string() + ": " + field, std::to_string(value), "a finite number");
    return value;
  }

  std::string read_name(const std::string& field) {
    const std::size_t end = content_.find('\0', at_);
    if (end == std::string::npos) need(content_.size() - at_ + 1, field);
    std::string name = content_.substr(at_, end - at_);
    at_ = end + 1;
    return name;
  }

  /// Skips `count` records of `size` bytes.
  void skip(std::uint64_t count, std::size_t size, const std::string& field) {
    if (count > (content_.size() - at_) / size) need_records(count, size, field);
    at_ += count * size;
  }

  /// A count of records of at least `size` bytes each, checked against what is left of the file.
  std::uint64_t read_count(std::size_t size, const std::string& field) {
    const auto count = read<std::uint64_t>(field);
    if (count > (content_.size() - at_) / size) need_records(count, size, field);
    return count;
  }

  void expect_end() const {
    if (at_ == content_.size()) return;
    throw_invalid(file_.string(), std::to_string(content_.size() - at_) + " bytes after the last record",
                  "the end of the file at byte " + std::to_string(at_));
  }

 private:
  void need(std::size_t bytes, const std::string& field) const {
    if (bytes <= content_.size() - at_) return;
    throw_invalid(file_.string() + ": " + field,
                  "the end of the file at byte " + std::to_string(content_.size()) + " (truncated)",
                  std::to_string(bytes) + " bytes from byte " + std::to_string(at_));
  }

  [[noreturn]] void need_records(std::uint64_t count, std::size_t size, const std::string& field) const {
    throw_invalid(file_.string() + ": " + field,
                  std::to_string(content_.size() - at_) + " bytes left in the file (truncated)",
                  std::to_string(count) + " records of at least " + std::to_string(size) + " bytes");
  }

  fs::path file_;
  std::string content_;
  std::size_t at_ = 0;
};

/// "camera 3 of 15".
std::string record(const char* what, std::uint64_t index, std::uint64_t count) {
  return std::string(what) + " " + std::to_string(index + 1) + " of " + std::to_string(count);
}

int checked_size(std::uint64_t size, const std::string& where) {
  if (size == 0 || size > 1u << 20) throw_invalid(where, std::to_string(size), "1 to 1048576 pixels");
  return static_cast<int>(size);
}

}  // namespace

std::map<int, Lens> read_colmap_cameras_binary(const fs::path& file) {
  ByteReader in(file);
  std::map<int, Lens> cameras;
  const std::uint64_t count = in.read_count(24 + 3 * 8, "number of cameras");
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::string which = record("camera", i, count), where = file.string() + ": " + which;
    const int id = in.read<std::int32_t>(which);
    const std::string model = colmap_model_name(in.read<std::int32_t>(which), where);
    const int width = checked_size(in.read<std::uint64_t>(which), where + ": width");
    const int height = checked_size(in.read<std::uint64_t>(which), where + ": height");
    std::vector<double> parameters(colmap_parameter_count(model, where));
    for (double& parameter : parameters) parameter = in.read_finite(which + ": parameters");
    const Lens lens = colmap_lens(model, width, height, parameters, where);
    check_lens(lens, where);
    if (!cameras.emplace(id, lens).second) {
      throw_invalid(where + ": id", std::to_string(id) + " for the second time", "each id once");
    }
  }
  in.expect_end();
  return cameras;
}

std::vector<ColmapImage> read_colmap_images_binary(const fs::path& file) {
  ByteReader in(file);
  std::vector<ColmapImage> images;
  const std::uint64_t count = in.read_count(4 + 7 * 8 + 4 + 1 + 8, "number of images");
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::string which = record("image", i, count);
    ColmapImage image;
    image.source = file.string() + ": " + which;
    image.id = in.read<std::int32_t>(which);
    Eigen::Vector4d q;
    Eigen::Vector3d t;
    for (double& value : q) value = in.read_finite(which + ": quaternion");
    for (double& value : t) value = in.read_finite(which + ": translation");
    image.camera_id = in.read<std::int32_t>(which);
    image.name = in.read_name(which + ": name");
    in.skip(in.read<std::uint64_t>(which), 24, which + ": observations");
    image.pose.rotation = rotation_from_quaternion(q, image.source + ": quaternion");
    image.pose.centre = -image.pose.rotation.transpose() * t;
    images.push_back(std::move(image));
  }
  in.expect_end();
  return images;
}

void read_colmap_points_binary(const fs::path& file, ColmapModel& model) {
  if (fs::file_size(file) == 0) return;
  ByteReader in(file);
  const std::uint64_t count = in.read_count(8 + 24 + 3 + 8 + 8, "number of points");
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::string which = record("point", i, count);
    in.read<std::uint64_t>(which);
    Eigen::Vector3d x;
    for (double& value : x) value = in.read_finite(which + ": position");
    in.skip(1, 3 + 8, which + ": colour and error");
    const auto track = in.read<std::uint64_t>(which);
    in.skip(track, 8, which + ": track");
    model.points.push_back(x);
    model.point_view_counts.push_back(static_cast<int>(track));
  }
  in.expect_end();
}

}  // namespace roxel
