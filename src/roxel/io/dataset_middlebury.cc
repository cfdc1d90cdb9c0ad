#include "roxel/io/dataset_middlebury.h"

#include "roxel/base/error.h"
#include "roxel/io/dataset_camera.h"
#include "roxel/io/dataset_files.h"
#include "roxel/io/dataset_text.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kFields = 22;

View parse_view(const std::vector<std::string_view>& fields, const fs::path& folder,
                const std::string& where) {
  if (fields.size() != kFields) {
    throw_invalid(where, std::to_string(fields.size()) + " fields", "22: image, K (9), R (9), t (3)");
  }
  View view;
  view.source = where;
  const std::string name(fields[0]);
  check_name(name, where + ": image");
  view.name = without_suffix(name);
  view.image_path = image_beside(folder, name).string();
  const std::vector<double> k = parse_numbers(fields, 1, 9, where, "K");
  const std::vector<double> r = parse_numbers(fields, 10, 9, where, "R");
  const std::vector<double> t = parse_numbers(fields, 19, 3, where, "t");
  view.lens.intrinsics = intrinsics_from_matrix(matrix_from_rows(k, 0), where);
  view.lens.intrinsics.cx += 0.5;
  view.lens.intrinsics.cy += 0.5;
  Pose& pose = view.camera.pose;
  pose.rotation = checked_rotation(matrix_from_rows(r, 0), where + ": R");
  pose.centre = -pose.rotation.transpose() * Eigen::Vector3d(t[0], t[1], t[2]);
  return view;
}

}  // namespace

fs::path find_middlebury(const fs::path& path) {
  const std::vector<fs::path> found = files_ending_in(path, {"_par.txt"});
  if (found.size() > 1) {
    throw_invalid(path.string(), found[0].filename().string() + " and " + found[1].filename().string(),
                  "one *_par.txt");
  }
  return found.empty() ? fs::path() : found[0];
}

Dataset read_middlebury(const fs::path& path) {
  const fs::path file = find_middlebury(path);
  const std::string content = read_text_file(file, "Middlebury's text: a count, then a line an image");
  Dataset dataset;
  std::optional<int> count;
  for (const TextLine& line : split_lines(content)) {
    const std::vector<std::string_view> fields = split_fields(line.text);
    const std::string where = at_line(file, line.number);
    if (fields.empty()) continue;
    if (!count) {
      count = parse_int(fields[0], where, "number of images");
    } else {
      dataset.views.push_back(parse_view(fields, file.parent_path(), where));
    }
  }
  if (static_cast<int>(dataset.views.size()) != count.value_or(0)) {
    throw_invalid(file.string(), std::to_string(dataset.views.size()) + " lines of cameras",
                  std::to_string(count.value_or(0)) + ", as its first line says");
  }
  return dataset;
}

}  // namespace roxel
