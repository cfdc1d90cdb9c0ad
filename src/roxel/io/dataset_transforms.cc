#include "roxel/io/dataset_transforms.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "roxel/base/error.h"
#include "roxel/io/dataset_camera.h"
#include "roxel/io/dataset_images.h"
#include "roxel/io/dataset_text.h"

namespace roxel {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string shown(const json& value) { return escaped(value.dump(), 120); }

const json* find_value(const json& object, const std::string& key) {
  const auto found = object.find(key);
  return found != object.end() && !found->is_null() ? &*found : nullptr;
}

/// Looks keys up in a frame, then in the top level: what all frames share may stand in either place. Time and
/// place may stand in an entry of the list `nodes`, too, for all frames of that node.
class FrameKeys {
 public:
  FrameKeys(const json& top, const json& frame, const std::string& file, std::string where)
      : top_(top), frame_(frame), file_(file), where_(std::move(where)) {}

  const std::string& where() const { return where_; }
  /// Where the key is found, or where it is missing.
  std::string where(const std::string& key) const {
    if (find_value(frame_, key)) return where_ + "." + key;
    if (const auto entry = node_entry(key)) return file_ + ": nodes[" + std::to_string(*entry) + "]." + key;
    return find_value(top_, key) ? file_ + ": " + key : where_ + "." + key;
  }

  const json* find(const std::string& key) const {
    if (const json* own = find_value(frame_, key)) return own;
    if (const auto entry = node_entry(key)) return find_value(top_["nodes"][*entry], key);
    return find_value(top_, key);
  }

  std::optional<double> number(const std::string& key) const {
    const json* value = find(key);
    if (!value) return std::nullopt;
    if (!value->is_number() || !std::isfinite(value->get<double>())) {
      throw_invalid(where(key), shown(*value), "a finite number");
    }
    return value->get<double>();
  }

  std::optional<int> whole(const std::string& key) const {
    const std::optional<double> value = number(key);
    if (!value) return std::nullopt;
    if (*value != std::floor(*value) || std::abs(*value) > 1e9) {
      throw_invalid(where(key), shown(*find(key)), "a whole number");
    }
    return static_cast<int>(*value);
  }

  std::optional<std::string> string(const std::string& key) const {
    const json* value = find(key);
    if (!value) return std::nullopt;
    if (!value->is_string()) throw_invalid(where(key), shown(*value), "a string");
    return value->get<std::string>();
  }

 private:
  /// The entry of `nodes` that has the key and is of the frame's node.
  std::optional<std::size_t> node_entry(const std::string& key) const {
    static constexpr const char* kOfNodes[] = {"time_utc", "latitude", "lat", "longitude", "lon"};
    if (std::find(std::begin(kOfNodes), std::end(kOfNodes), key) == std::end(kOfNodes)) return std::nullopt;
    const json* nodes = find_value(top_, "nodes");
    const json* node = find_value(frame_, "node");
    if (!nodes || !nodes->is_array() || !node) return std::nullopt;
    std::optional<std::size_t> entry;
    for (std::size_t i = 0; i < nodes->size(); ++i) {
      const json& candidate = (*nodes)[i];
      if (!candidate.is_object() || !find_value(candidate, key)) continue;
      if (const json* id = find_value(candidate, "node"); !id || *id != *node) continue;
      if (entry)
        throw_invalid(file_ + ": nodes[" + std::to_string(i) + "]",
                      "node " + shown(*node) + " as nodes[" + std::to_string(*entry) + "] has",
                      "one entry a node");
      entry = i;
    }
    return entry;
  }

  const json& top_;
  const json& frame_;
  std::string file_;
  std::string where_;
};

/// The quoted text that surrounds byte `at`.
std::string_view string_around(std::string_view content, std::size_t at) {
  const std::size_t begin = content.rfind('"', at);
  const std::size_t end = content.find('"', at);
  const std::size_t first = begin == std::string_view::npos ? at : begin + 1;
  return content.substr(first, end == std::string_view::npos ? 80 : end - first);
}

void check_utf8(const std::string& content, const fs::path& file) {
  if (is_valid_utf8(content)) return;
  std::size_t good = 0;  // bisect for the longest valid prefix that ends at a character
  for (std::size_t step = std::size_t{1} << 40; step > 0; step /= 2) {
    if (good + step > content.size()) continue;
    std::size_t end = good + step;
    while (end < content.size() && (static_cast<unsigned char>(content[end]) & 0xC0) == 0x80) ++end;
    if (is_valid_utf8(std::string_view(content).substr(good, end - good))) good = end;
  }
  const int line = 1 + static_cast<int>(std::count(
                           content.begin(), content.begin() + static_cast<std::ptrdiff_t>(good), '\n'));
  throw_invalid(at_line(file, line),
                "'" + escaped(string_around(content, std::min(good, content.size() - 1)), 400) +
                    "' with bytes that are not UTF-8",
                "UTF-8 text");
}

/// The key whose value the broken byte belongs to, for messages: the last "key": before it.
std::string key_before(std::string_view content, std::size_t at) {
  const std::size_t colon = content.rfind("\":", at);
  if (colon == std::string_view::npos) return "";
  const std::size_t quote = colon == 0 ? colon : content.rfind('"', colon - 1);
  if (quote == std::string_view::npos || quote >= colon) return "";
  return ": " + escaped(content.substr(quote + 1, colon - quote - 1));
}

json parse_json(const fs::path& file) {
  const std::string content = read_whole_file(file);
  if (const std::string kind = kind_of_content(content); kind != "JSON")
    throw_invalid(file.string(), kind, "JSON");
  check_utf8(content, file);
  try {
    return json::parse(content);
  } catch (const json::parse_error& error) {
    const std::size_t at = std::min(error.byte > 0 ? error.byte - 1 : 0, content.size() - 1);
    const int line = 1 + static_cast<int>(std::count(
                             content.begin(), content.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
    // The parser stops inside a word that it does not know: show it from its beginning.
    const std::size_t separator = content.find_last_of(" \t\r\n,:[{", at > 0 ? at - 1 : 0);
    const std::size_t begin = separator == std::string::npos ? 0 : separator + 1;
    const std::size_t end = std::min(content.find_first_of(",]}\n", begin), begin + 40);
    const std::string found = content.substr(begin, end - begin);
    const bool not_finite =
        found.find("NaN") != std::string::npos || found.find("Infinity") != std::string::npos;
    const bool truncated = error.byte >= content.size();
    throw_invalid(at_line(file, line) + key_before(content, at),
                  truncated ? "the end of the file" : "'" + escaped(found) + "'",
                  not_finite ? "a finite number" : "valid JSON");
  }
}

/// The image's file: file_path as it is, or with a suffix that it leaves out (as the NeRF synthetic sets do).
fs::path resolve_image(const fs::path& folder, const std::string& file_path) {
  const fs::path plain = (folder / file_path).lexically_normal();
  if (fs::is_regular_file(plain)) return plain;
  for (const char* suffix : {".png", ".jpg", ".jpeg", ".JPG", ".PNG", ".exr", ".hdr", ".tif", ".tiff"}) {
    const fs::path with_suffix = plain.string() + suffix;
    if (fs::is_regular_file(with_suffix)) return with_suffix;
  }
  return plain;
}

double checked_angle(const FrameKeys& keys, const std::string& key, double angle) {
  if (!(angle > 0 && angle < M_PI))
    throw_invalid(keys.where(key), std::to_string(angle), "an angle in (0, pi) radians");
  return angle;
}

Intrinsics read_intrinsics(const FrameKeys& keys, const fs::path& image) {
  Intrinsics k;
  const std::optional<int> width = keys.whole("w"), height = keys.whole("h");
  ImageSize size;
  if (!width || !height) size = checked_image_size(image, keys.where());
  k.width = width.value_or(size.width);
  k.height = height.value_or(size.height);
  const std::optional<double> fx = keys.number("fl_x"), fy = keys.number("fl_y");
  const std::optional<double> angle_x = keys.number("camera_angle_x"),
                              angle_y = keys.number("camera_angle_y");
  if (fx) {
    k.fx = *fx;
  } else if (angle_x) {
    k.fx = 0.5 * k.width / std::tan(0.5 * checked_angle(keys, "camera_angle_x", *angle_x));
  } else {
    throw_invalid(keys.where(), "neither fl_x nor camera_angle_x", "one of them, in the frame or shared");
  }
  if (fy) {
    k.fy = *fy;
  } else if (angle_y && !fx) {
    k.fy = 0.5 * k.height / std::tan(0.5 * checked_angle(keys, "camera_angle_y", *angle_y));
  } else {
    k.fy = k.fx;
  }
  if (!(k.fx > 0)) throw_invalid(keys.where("fl_x"), std::to_string(k.fx), "a focal length above 0");
  if (!(k.fy > 0)) throw_invalid(keys.where("fl_y"), std::to_string(k.fy), "a focal length above 0");
  k.cx = keys.number("cx").value_or(0.5 * k.width);
  k.cy = keys.number("cy").value_or(0.5 * k.height);
  k.skew = keys.number("skew").value_or(0);
  return k;
}

constexpr std::array<const char*, 11> kCoefficients = {"k1", "k2", "k3",  "k4",  "k5",   "k6",
                                                       "p1", "p2", "sx1", "sy1", "omega"};
constexpr std::array<LensModel, 10> kLensModels = {
    LensModel::kPinhole,          LensModel::kSimpleRadial,
    LensModel::kRadial,           LensModel::kOpenCv,
    LensModel::kFullOpenCv,       LensModel::kSimpleRadialFisheye,
    LensModel::kRadialFisheye,    LensModel::kOpenCvFisheye,
    LensModel::kThinPrismFisheye, LensModel::kFov};

bool has_coefficient(LensModel model, const std::string& name) {
  const std::vector<std::string> names = lens_coefficient_names(model);
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// The model that the file names; empty where it names none.
std::optional<LensModel> named_model(const FrameKeys& keys) {
  if (const json* fisheye = keys.find("is_fisheye");
      fisheye && fisheye->is_boolean() && fisheye->get<bool>()) {
    return LensModel::kOpenCvFisheye;
  }
  const std::optional<std::string> name = keys.string("camera_model");
  if (!name) return std::nullopt;
  if (*name == "SIMPLE_PINHOLE") return LensModel::kPinhole;
  std::string known = "one of SIMPLE_PINHOLE";
  for (LensModel model : kLensModels) {
    if (*name == lens_model_name(model)) return model;
    known += std::string(" ") + lens_model_name(model);
  }
  throw_invalid(keys.where("camera_model"), "'" + escaped(*name) + "'", known);
}

/// The smallest of the perspective models that has all the non-zero coefficients.
LensModel model_for(const FrameKeys& keys) {
  for (LensModel model : {LensModel::kPinhole, LensModel::kSimpleRadial, LensModel::kRadial,
                          LensModel::kOpenCv, LensModel::kFullOpenCv}) {
    const bool holds = std::all_of(kCoefficients.begin(), kCoefficients.end(), [&](const char* name) {
      return has_coefficient(model, name) || keys.number(name).value_or(0) == 0;
    });
    if (holds) return model;
  }
  return LensModel::kFullOpenCv;
}

Lens read_lens(const FrameKeys& keys, const fs::path& image) {
  Lens lens;
  lens.intrinsics = read_intrinsics(keys, image);
  const std::optional<LensModel> named = named_model(keys);
  lens.model = named.value_or(model_for(keys));
  // Some tools write OPENCV with a third radial coefficient, which COLMAP calls FULL_OPENCV.
  const bool third = keys.number("k3").value_or(0) != 0 && keys.number("k4").value_or(0) == 0;
  if (lens.model == LensModel::kOpenCv && third) lens.model = LensModel::kFullOpenCv;
  for (const char* name : kCoefficients) {
    if (has_coefficient(lens.model, name) || keys.number(name).value_or(0) == 0) continue;
    throw_invalid(keys.where(name), shown(*keys.find(name)),
                  std::string("0, since camera model ") + lens_model_name(lens.model) + " does not have it");
  }
  const std::vector<std::string> names = lens_coefficient_names(lens.model);
  for (std::size_t i = 0; i < names.size(); ++i) lens.coefficients[i] = keys.number(names[i]).value_or(0);
  return lens;
}

Pose read_pose(const FrameKeys& keys) {
  const json* matrix = keys.find("transform_matrix");
  const std::string where = keys.where("transform_matrix");
  if (!matrix) throw_invalid(where, "nothing", "a 4 x 4 camera-to-world matrix");
  const bool shaped = matrix->is_array() && (matrix->size() == 4 || matrix->size() == 3) &&
                      std::all_of(matrix->begin(), matrix->end(),
                                  [](const json& row) { return row.is_array() && row.size() == 4; });
  if (!shaped) throw_invalid(where, shown(*matrix), "a 4 x 4 camera-to-world matrix");
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  for (std::size_t row = 0; row < matrix->size(); ++row) {
    for (std::size_t column = 0; column < 4; ++column) {
      const json& value = (*matrix)[row][column];
      if (!value.is_number() || !std::isfinite(value.get<double>())) {
        throw_invalid(where + "[" + std::to_string(row) + "][" + std::to_string(column) + "]", shown(value),
                      "a finite number");
      }
      m(static_cast<int>(row), static_cast<int>(column)) = value.get<double>();
    }
  }
  if (m.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    throw_invalid(where + "[3]", shown((*matrix)[3]), "[0, 0, 0, 1]");
  // OpenGL's camera has y up and looks along -z.
  const Eigen::Matrix3d world_from_camera =
      checked_rotation(m.topLeftCorner<3, 3>(), where) * Eigen::Vector3d(1, -1, -1).asDiagonal();
  return {world_from_camera.transpose(), m.topRightCorner<3, 1>()};
}

std::optional<double> angle_within(const FrameKeys& keys, std::initializer_list<const char*> names,
                                   double limit) {
  for (const char* name : names) {
    const std::optional<double> degrees = keys.number(name);
    if (!degrees) continue;
    if (std::abs(*degrees) > limit) {
      const std::string to = std::to_string(static_cast<int>(limit));
      throw_invalid(keys.where(name), shown(*keys.find(name)), "-" + to + " to " + to + " degrees");
    }
    return degrees;
  }
  return std::nullopt;
}

void read_depth_range(const FrameKeys& keys, View& view) {
  view.near = keys.number("near");
  view.far = keys.number("far");
  if (view.near && !(*view.near > 0))
    throw_invalid(keys.where("near"), shown(*keys.find("near")), "more than 0");
  if (view.far && !(*view.far > view.near.value_or(0))) {
    throw_invalid(keys.where("far"), shown(*keys.find("far")),
                  "more than near, " + (view.near ? shown(*keys.find("near")) : std::string("0")));
  }
}

View read_frame(const FrameKeys& keys, const fs::path& folder) {
  View view;
  view.source = keys.where();
  const std::optional<std::string> file_path = keys.string("file_path");
  if (!file_path || file_path->empty()) throw_invalid(keys.where("file_path"), "nothing", "the image's path");
  check_name(*file_path, keys.where("file_path"));
  const fs::path image = resolve_image(folder, *file_path);
  view.image_path = image.string();
  if (const std::optional<std::string> mask = keys.string("mask_path"); mask && !mask->empty()) {
    check_name(*mask, keys.where("mask_path"));
    view.mask_path = (folder / *mask).lexically_normal().string();
  }
  view.lens = read_lens(keys, image);
  view.camera.pose = read_pose(keys);
  view.node_id = keys.whole("node");
  if (keys.find("time_utc")) {
    const json& time = *keys.find("time_utc");
    view.time_utc_s =
        parse_utc_time(time.is_string() ? time.get<std::string>() : time.dump(), keys.where("time_utc"));
  }
  view.latitude_deg = angle_within(keys, {"latitude", "lat"}, 90);
  view.longitude_deg = angle_within(keys, {"longitude", "lon"}, 180);
  read_depth_range(keys, view);
  return view;
}

std::optional<Eigen::AlignedBox3d> read_scene_bounds(const json& top, const fs::path& file) {
  const auto found = top.find("scene_bounds");
  if (found == top.end() || found->is_null()) return std::nullopt;
  std::vector<double> values;
  const auto collect = [&](const json& value, const auto& self) -> void {
    if (value.is_array()) {
      for (const json& element : value) self(element, self);
    } else {
      values.push_back(value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN());
    }
  };
  collect(*found, collect);
  bool ordered = values.size() == 6;
  for (std::size_t axis = 0; ordered && axis < 3; ++axis) ordered = values[axis] < values[axis + 3];
  if (!ordered) {
    throw_invalid(file.string() + ": scene_bounds", shown(*found),
                  "[[x0, y0, z0], [x1, y1, z1]] with x0 < x1, ...");
  }
  return Eigen::AlignedBox3d(Eigen::Vector3d(values[0], values[1], values[2]),
                             Eigen::Vector3d(values[3], values[4], values[5]));
}

/// Names count from the image folder where all images lie in one, else from the data set's folder.
void name_views(const fs::path& folder, std::vector<View>& views) {
  const auto within = [](const fs::path& root, const View& view) {
    const fs::path relative = fs::path(view.image_path).lexically_relative(root);
    return !relative.empty() && *relative.begin() != "..";
  };
  fs::path root = folder / "images";
  if (!std::all_of(views.begin(), views.end(), [&](const View& v) { return within(root, v); })) root = folder;
  for (View& view : views) {
    const fs::path image = view.image_path;
    view.name = without_suffix(within(root, view) ? image.lexically_relative(root).string()
                                                  : image.filename().string());
  }
}

}  // namespace

fs::path find_transforms(const fs::path& path) {
  if (fs::is_regular_file(path)) return path;
  for (const char* name : {"transforms.json", "transforms_train.json"}) {
    if (fs::is_regular_file(path / name)) return path / name;
  }
  return {};
}

Dataset read_transforms(const fs::path& path) {
  const fs::path file = find_transforms(path);
  const json top = parse_json(file);
  const auto frames = top.is_object() ? top.find("frames") : top.end();
  if (!top.is_object() || frames == top.end() || !frames->is_array() || frames->empty()) {
    throw_invalid(file.string() + ": frames",
                  top.is_object() && frames != top.end() ? shown(*frames) : "nothing",
                  "a list of at least one frame");
  }
  const fs::path folder = fs::absolute(file).lexically_normal().parent_path();
  Dataset dataset;
  for (std::size_t i = 0; i < frames->size(); ++i) {
    const std::string where = file.string() + ": frames[" + std::to_string(i) + "]";
    if (!(*frames)[i].is_object()) throw_invalid(where, shown((*frames)[i]), "an object");
    dataset.views.push_back(read_frame(FrameKeys(top, (*frames)[i], file.string(), where), folder));
  }
  name_views(folder, dataset.views);
  dataset.scene_bounds = read_scene_bounds(top, file);
  return dataset;
}

}  // namespace roxel
