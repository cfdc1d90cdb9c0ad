#include "roxel/io/dataset_krt.h"

#include "roxel/base/error.h"
#include "roxel/io/dataset_camera.h"
#include "roxel/io/dataset_files.h"
#include "roxel/io/dataset_text.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kKrtNumbers = 21;

bool holds_krt(const fs::path& file) {
  if (fs::file_size(file) > 4096) return false;
  try {
    return parse_number_file(file, read_whole_file(file), "number").size() == kKrtNumbers;
  } catch (const InvalidInput&) {
    return false;
  }
}

/// The image whose name, with or without its suffix, is `stem`; empty where there is none.
fs::path image_named(const std::vector<fs::path>& folders, const std::string& stem) {
  for (const fs::path& folder : folders) {
    if (has_image_suffix(stem) && fs::is_regular_file(folder / stem)) return folder / stem;
    for (const fs::path& file : image_files(folder)) {
      if (without_suffix(file.filename().string()) == stem) return file;
    }
  }
  return {};
}

std::vector<fs::path> image_folders(const fs::path& path) {
  return {path / "images", path, path / "cameras", path / "krt"};
}

View read_krt_camera(const fs::path& file, const fs::path& path) {
  const std::string where = file.string();
  check_name(file.filename().string(), where);
  const std::vector<double> n =
      parse_number_file(file, read_text_file(file, "KRT text: K (9), R (9), t (3)"), "number");
  if (n.size() != kKrtNumbers) {
    throw_invalid(where, std::to_string(n.size()) + " numbers", "21: K (9), R (9), t (3)");
  }
  View view;
  view.source = where;
  const std::string stem = file.filename().replace_extension().string();
  const fs::path image = image_named(image_folders(path), stem);
  if (image.empty()) throw_invalid(where, "no image named " + stem + " in images/ or beside it", "one");
  view.name = without_suffix(image.filename().string());
  view.image_path = fs::absolute(image).lexically_normal().string();
  view.lens.intrinsics = intrinsics_from_matrix(matrix_from_rows(n, 0), where);
  Pose& pose = view.camera.pose;
  pose.rotation = checked_rotation(matrix_from_rows(n, 9), where + ": R");
  pose.centre = -pose.rotation.transpose() * Eigen::Vector3d(n[18], n[19], n[20]);
  return view;
}

}  // namespace

std::vector<fs::path> find_krt(const fs::path& path) {
  for (const char* folder : {"cameras", "krt", ""}) {
    std::vector<fs::path> found = files_ending_in(path / folder, {".krt"});
    if (!found.empty()) return found;
  }
  for (const char* folder : {"cameras", "krt", ""}) {
    std::vector<fs::path> found;
    for (const fs::path& file : files_ending_in(path / folder, {".txt"})) {
      const std::string stem = file.filename().replace_extension().string();
      if (holds_krt(file) || !image_named(image_folders(path), stem).empty()) found.push_back(file);
    }
    if (!found.empty()) return found;
  }
  return {};
}

Dataset read_krt(const fs::path& path) {
  Dataset dataset;
  for (const fs::path& file : find_krt(path)) dataset.views.push_back(read_krt_camera(file, path));
  return dataset;
}

}  // namespace roxel
