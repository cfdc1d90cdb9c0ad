#include "roxel/io/dataset_strecha.h"

#include <cmath>

#include "roxel/base/error.h"
#include "roxel/io/dataset_camera.h"
#include "roxel/io/dataset_files.h"
#include "roxel/io/dataset_text.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kStrechaNumbers = 9 + 3 + 9 + 3 + 2;

int checked_size(double size, const std::string& where) {
  if (!(size >= 1 && size <= 1 << 20) || size != std::floor(size)) {
    throw_invalid(where, std::to_string(size), "a whole number of pixels above 0");
  }
  return static_cast<int>(size);
}

View read_strecha_camera(const fs::path& file, const fs::path& folder) {
  const std::string where = file.string();
  const std::vector<double> n =
      parse_number_file(file, read_text_file(file, "Strecha's text: K, 0 0 0, R, C, width height"), "number");
  if (n.size() != kStrechaNumbers) {
    throw_invalid(where, std::to_string(n.size()) + " numbers",
                  "26: K (9), 0 0 0, R (9), C (3), width height");
  }
  if (n[9] != 0 || n[10] != 0 || n[11] != 0) {
    throw_invalid(where + ": fourth row",
                  std::to_string(n[9]) + " " + std::to_string(n[10]) + " " + std::to_string(n[11]),
                  "0 0 0 (images without distortion)");
  }
  View view;
  view.source = where;
  const std::string image = file.filename().replace_extension().string();
  check_name(image, where);
  view.name = without_suffix(image);
  view.image_path = image_beside(folder, image).string();
  view.lens.intrinsics = intrinsics_from_matrix(matrix_from_rows(n, 0), where);
  view.lens.intrinsics.width = checked_size(n[24], where + ": width");
  view.lens.intrinsics.height = checked_size(n[25], where + ": height");
  view.camera.pose.rotation = checked_rotation(matrix_from_rows(n, 12), where + ": R").transpose();
  view.camera.pose.centre = {n[21], n[22], n[23]};
  return view;
}

}  // namespace

std::vector<fs::path> find_strecha(const fs::path& path) {
  std::vector<fs::path> found = files_ending_in(path / "cameras", {".camera"});
  return found.empty() ? files_ending_in(path, {".camera"}) : found;
}

Dataset read_strecha(const fs::path& path) {
  Dataset dataset;
  for (const fs::path& file : find_strecha(path)) dataset.views.push_back(read_strecha_camera(file, path));
  return dataset;
}

}  // namespace roxel
