#include "roxel/io/dataset_colmap.h"

#include <algorithm>
#include <array>
#include <set>

#include "roxel/base/error.h"
#include "roxel/io/dataset_camera.h"
#include "roxel/io/dataset_text.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;

struct ColmapLensModel {
  const char* name;  // in the order of COLMAP's model ids
  LensModel model;
  bool one_focal_length;
};

constexpr std::array<ColmapLensModel, 11> kModels = {{
    {"SIMPLE_PINHOLE", LensModel::kPinhole, true},
    {"PINHOLE", LensModel::kPinhole, false},
    {"SIMPLE_RADIAL", LensModel::kSimpleRadial, true},
    {"RADIAL", LensModel::kRadial, true},
    {"OPENCV", LensModel::kOpenCv, false},
    {"OPENCV_FISHEYE", LensModel::kOpenCvFisheye, false},
    {"FULL_OPENCV", LensModel::kFullOpenCv, false},
    {"FOV", LensModel::kFov, false},
    {"SIMPLE_RADIAL_FISHEYE", LensModel::kSimpleRadialFisheye, true},
    {"RADIAL_FISHEYE", LensModel::kRadialFisheye, true},
    {"THIN_PRISM_FISHEYE", LensModel::kThinPrismFisheye, false},
}};

std::string known_models() {
  std::string names = "one of";
  for (const ColmapLensModel& known : kModels) names += std::string(" ") + known.name;
  return names;
}

const ColmapLensModel& find_model(const std::string& name, const std::string& where) {
  const auto found = std::find_if(kModels.begin(), kModels.end(),
                                  [&](const ColmapLensModel& known) { return name == known.name; });
  if (found == kModels.end()) {
    throw_invalid(where + ": camera model", "'" + escaped(name) + "'", known_models());
  }
  return *found;
}

std::size_t parameter_count(const ColmapLensModel& known) {
  return (known.one_focal_length ? 3 : 4) + lens_coefficient_names(known.model).size();
}

bool is_content(const TextLine& line) {
  const std::vector<std::string_view> fields = split_fields(line.text.substr(0, 64));
  return !fields.empty() && fields[0].front() != '#';
}

/// Names may hold spaces: everything from the tenth field to the end of the line.
std::string name_field(std::string_view line, const std::vector<std::string_view>& fields) {
  std::string_view name = line.substr(static_cast<std::size_t>(fields[9].data() - line.data()));
  while (!name.empty() && (name.back() == ' ' || name.back() == '\t')) name.remove_suffix(1);
  return std::string(name);
}

ColmapImage parse_image_line(const fs::path& file, const TextLine& line) {
  ColmapImage image;
  image.source = at_line(file, line.number);
  const std::vector<std::string_view> fields = split_fields(line.text);
  if (fields.size() < 10) {
    throw_invalid(image.source, std::to_string(fields.size()) + " fields ('" + escaped(line.text) + "')",
                  "10: IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME");
  }
  image.id = parse_int(fields[0], image.source, "IMAGE_ID");
  const std::vector<double> q = parse_numbers(fields, 1, 4, image.source, "QW QX QY QZ");
  const std::vector<double> t = parse_numbers(fields, 5, 3, image.source, "TX TY TZ");
  image.camera_id = parse_int(fields[8], image.source, "CAMERA_ID");
  image.name = name_field(line.text, fields);
  image.pose.rotation = rotation_from_quaternion({q[0], q[1], q[2], q[3]}, image.source + ": QW QX QY QZ");
  image.pose.centre = -image.pose.rotation.transpose() * Eigen::Vector3d(t[0], t[1], t[2]);
  return image;
}

/// The second line of an image: X Y POINT3D_ID triples, or nothing.
void check_observations(const fs::path& file, const TextLine& line) {
  const std::size_t fields = split_fields(line.text).size();
  if (fields % 3 == 0) return;
  throw_invalid(at_line(file, line.number), std::to_string(fields) + " fields ('" + escaped(line.text) + "')",
                "X Y POINT3D_ID triples, or an empty line, after each image");
}

fs::path sibling(const fs::path& folder, const char* stem, const char* suffix) {
  return folder / (std::string(stem) + suffix);
}

void check_references(const ColmapModel& model, const fs::path& folder, const char* suffix) {
  for (const ColmapImage& image : model.images) {
    check_name(image.name, image.source + ": NAME");
    if (model.cameras.contains(image.camera_id)) continue;
    std::string ids;
    for (const auto& [id, lens] : model.cameras) {
      if (ids.size() > 60) {
        ids += " ...";
        break;
      }
      ids += " " + std::to_string(id);
    }
    throw_invalid(image.source + ": CAMERA_ID", std::to_string(image.camera_id),
                  "a camera of " + sibling(folder, "cameras", suffix).string() + " (" +
                      (ids.empty() ? "it has none" : "it has" + ids) + ")");
  }
}

/// Of the folders where a model's images may be, the one that has most of them.
fs::path find_image_root(const fs::path& path, const fs::path& folder, const ColmapModel& model) {
  std::vector<fs::path> roots = {path / "images", path, folder / "images", folder.parent_path() / "images",
                                 folder.parent_path().parent_path() / "images"};
  fs::path best = fs::is_directory(roots[0]) ? roots[0] : roots[1];
  std::size_t most = 0;
  for (const fs::path& root : roots) {
    if (!fs::is_directory(root)) continue;
    const auto found = static_cast<std::size_t>(
        std::count_if(model.images.begin(), model.images.end(),
                      [&](const ColmapImage& image) { return fs::is_regular_file(root / image.name); }));
    if (found <= most) continue;
    most = found;
    best = root;
  }
  return best;
}

}  // namespace

std::size_t colmap_parameter_count(const std::string& model_name, const std::string& where) {
  return parameter_count(find_model(model_name, where));
}

std::string colmap_model_name(int model_id, const std::string& where) {
  if (model_id < 0 || model_id >= static_cast<int>(kModels.size())) {
    throw_invalid(where + ": camera model", "id " + std::to_string(model_id),
                  "0 to 10, the ids of " + known_models().substr(7));
  }
  return kModels[static_cast<std::size_t>(model_id)].name;
}

Lens colmap_lens(const std::string& model_name, int width, int height, const std::vector<double>& parameters,
                 const std::string& where) {
  const ColmapLensModel& known = find_model(model_name, where);
  if (parameters.size() != parameter_count(known)) {
    throw_invalid(where + ": parameters of " + model_name, std::to_string(parameters.size()),
                  std::to_string(parameter_count(known)));
  }
  Lens lens;
  lens.model = known.model;
  lens.intrinsics.width = width;
  lens.intrinsics.height = height;
  lens.intrinsics.fx = parameters[0];
  lens.intrinsics.fy = parameters[known.one_focal_length ? 0 : 1];
  const std::size_t rest = known.one_focal_length ? 1 : 2;
  lens.intrinsics.cx = parameters[rest];
  lens.intrinsics.cy = parameters[rest + 1];
  std::copy(parameters.begin() + static_cast<std::ptrdiff_t>(rest) + 2, parameters.end(),
            lens.coefficients.begin());
  return lens;
}

std::vector<double> colmap_parameters(const Lens& lens) {
  const Intrinsics& k = lens.intrinsics;
  const ColmapLensModel& known = find_model(lens_model_name(lens.model), "camera");
  std::vector<double> parameters = {k.fx};
  if (!known.one_focal_length) parameters.push_back(k.fy);
  parameters.insert(parameters.end(), {k.cx, k.cy});
  const std::size_t count = lens_coefficient_names(lens.model).size();
  parameters.insert(parameters.end(), lens.coefficients.begin(),
                    lens.coefficients.begin() + static_cast<std::ptrdiff_t>(count));
  return parameters;
}

std::map<int, Lens> read_colmap_cameras_text(const fs::path& file) {
  const std::string content = read_text_file(file, "COLMAP's text: CAMERA_ID MODEL WIDTH HEIGHT PARAMS...");
  std::map<int, Lens> cameras;
  for (const TextLine& line : split_lines(content)) {
    if (!is_content(line)) continue;
    const std::string where = at_line(file, line.number);
    const std::vector<std::string_view> fields = split_fields(line.text);
    if (fields.size() < 4) {
      throw_invalid(where, std::to_string(fields.size()) + " fields ('" + escaped(line.text) + "')",
                    "CAMERA_ID MODEL WIDTH HEIGHT PARAMS...");
    }
    const int id = parse_int(fields[0], where, "CAMERA_ID");
    const int width = parse_int(fields[2], where, "WIDTH"), height = parse_int(fields[3], where, "HEIGHT");
    const std::vector<double> parameters = parse_numbers(fields, 4, fields.size() - 4, where, "PARAMS");
    const Lens lens = colmap_lens(std::string(fields[1]), width, height, parameters, where);
    check_lens(lens, where);
    if (!cameras.emplace(id, lens).second) {
      throw_invalid(where + ": CAMERA_ID", std::to_string(id) + " for the second time", "each id once");
    }
  }
  return cameras;
}

std::vector<ColmapImage> read_colmap_images_text(const fs::path& file) {
  const std::string content = read_text_file(file, "COLMAP's text, two lines an image");
  const std::vector<TextLine> lines = split_lines(content);
  std::vector<ColmapImage> images;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (!is_content(lines[i])) continue;
    images.push_back(parse_image_line(file, lines[i]));
    if (++i < lines.size()) check_observations(file, lines[i]);
  }
  return images;
}

void read_colmap_points_text(const fs::path& file, ColmapModel& model) {
  if (fs::file_size(file) == 0) return;
  const std::string content = read_text_file(file, "COLMAP's text: POINT3D_ID X Y Z R G B ERROR TRACK...");
  for (const TextLine& line : split_lines(content)) {
    if (!is_content(line)) continue;
    const std::string where = at_line(file, line.number);
    const std::vector<std::string_view> fields = split_fields(line.text);
    if (fields.size() < 8) {
      throw_invalid(where, std::to_string(fields.size()) + " fields ('" + escaped(line.text) + "')",
                    "POINT3D_ID X Y Z R G B ERROR TRACK...");
    }
    const std::vector<double> x = parse_numbers(fields, 1, 3, where, "X Y Z");
    model.points.emplace_back(x[0], x[1], x[2]);
    model.point_view_counts.push_back(static_cast<int>((fields.size() - 8) / 2));
  }
}

fs::path find_colmap_model(const fs::path& path) {
  for (const fs::path& folder : {path / "sparse" / "0", path / "sparse", path}) {
    for (const char* stem : {"cameras", "images"}) {
      for (const char* suffix : {".bin", ".txt"}) {
        if (fs::is_regular_file(sibling(folder, stem, suffix))) return folder;
      }
    }
  }
  return {};
}

ColmapModel read_colmap_model(const fs::path& folder) {
  const bool binary =
      fs::exists(sibling(folder, "cameras", ".bin")) || fs::exists(sibling(folder, "images", ".bin"));
  const char* suffix = binary ? ".bin" : ".txt";
  const fs::path cameras = sibling(folder, "cameras", suffix), images = sibling(folder, "images", suffix);
  const fs::path points = sibling(folder, "points3D", suffix);
  ColmapModel model;
  model.cameras = binary ? read_colmap_cameras_binary(cameras) : read_colmap_cameras_text(cameras);
  model.images = binary ? read_colmap_images_binary(images) : read_colmap_images_text(images);
  if (fs::exists(points)) {
    if (binary) {
      read_colmap_points_binary(points, model);
    } else {
      read_colmap_points_text(points, model);
    }
  }
  if (model.images.empty()) throw_invalid(images.string(), "no images", "at least one");
  check_references(model, folder, suffix);
  return model;
}

Dataset read_colmap(const fs::path& path) {
  const fs::path folder = find_colmap_model(path);
  ColmapModel model = read_colmap_model(folder);
  const fs::path root = find_image_root(path, folder, model);
  Dataset dataset;
  for (const ColmapImage& image : model.images) {
    View view;
    view.name = without_suffix(image.name);
    view.image_path = fs::absolute(root / image.name).lexically_normal().string();
    view.source = image.source;
    view.lens = model.cameras.at(image.camera_id);
    view.camera.pose = image.pose;
    dataset.views.push_back(std::move(view));
  }
  dataset.points = std::move(model.points);
  const std::vector<int>& counts = model.point_view_counts;
  // Tools that export bare points leave the tracks empty.
  const bool known = std::any_of(counts.begin(), counts.end(), [](int count) { return count > 0; });
  if (known) dataset.point_view_counts = counts;
  return dataset;
}

}  // namespace roxel
