#include "roxel/io/ply_file.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <optional>

#include "roxel/base/error.h"
#include "roxel/io/dataset_text.h"

namespace roxel {
namespace {

enum class Number { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };
enum class Encoding { kAscii, kLittleEndian, kBigEndian };

struct Property {
  std::string name;
  Number type = Number::kFloat32;
  std::optional<Number> list_count;  ///< type of a list's length; none: a single value
};

struct Element {
  std::string name;
  std::int64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  Encoding encoding = Encoding::kAscii;
  std::vector<Element> elements;
  std::size_t size = 0;  ///< bytes
  int lines = 0;
};

std::optional<Number> number_type(std::string_view name) {
  static constexpr std::pair<const char*, Number> kNames[] = {
      {"char", Number::kInt8},      {"int8", Number::kInt8},       {"uchar", Number::kUint8},
      {"uint8", Number::kUint8},    {"short", Number::kInt16},     {"int16", Number::kInt16},
      {"ushort", Number::kUint16},  {"uint16", Number::kUint16},   {"int", Number::kInt32},
      {"int32", Number::kInt32},    {"uint", Number::kUint32},     {"uint32", Number::kUint32},
      {"float", Number::kFloat32},  {"float32", Number::kFloat32}, {"double", Number::kFloat64},
      {"float64", Number::kFloat64}};
  for (const auto& [text, type] : kNames)
    if (name == text) return type;
  return {};
}

std::size_t size_of(Number type) {
  switch (type) {
    case Number::kInt8:
    case Number::kUint8:
      return 1;
    case Number::kInt16:
    case Number::kUint16:
      return 2;
    case Number::kInt32:
    case Number::kUint32:
    case Number::kFloat32:
      return 4;
    case Number::kFloat64:
      return 8;
  }
  return 0;
}

template <class T>
double value_as(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return static_cast<double>(value);
}

double value_of(Number type, const char* bytes) {
  switch (type) {
    case Number::kInt8:
      return value_as<std::int8_t>(bytes);
    case Number::kUint8:
      return value_as<std::uint8_t>(bytes);
    case Number::kInt16:
      return value_as<std::int16_t>(bytes);
    case Number::kUint16:
      return value_as<std::uint16_t>(bytes);
    case Number::kInt32:
      return value_as<std::int32_t>(bytes);
    case Number::kUint32:
      return value_as<std::uint32_t>(bytes);
    case Number::kFloat32:
      return value_as<float>(bytes);
    case Number::kFloat64:
      return value_as<double>(bytes);
  }
  return 0;
}

/// Reads the header line by line.
class HeaderReader {
 public:
  HeaderReader(const std::filesystem::path& path, std::string_view content)
      : path_(path), content_(content) {}

  Header read() {
    if (next() != "ply") throw_invalid(path_.string(), kind_of_content(content_), "a PLY file");
    for (;;) {
      const std::string_view line = next();
      const std::vector<std::string_view> fields = split_fields(line);
      if (fields.empty() || fields[0] == "comment" || fields[0] == "obj_info") continue;
      if (fields[0] == "end_header") break;
      if (fields[0] == "format") {
        read_format(fields);
      } else if (fields[0] == "element") {
        read_element(fields);
      } else if (fields[0] == "property") {
        read_property(fields);
      } else {
        fail(line, "format, element, property, comment or end_header");
      }
    }
    if (!has_format_)
      throw_invalid(path_.string(), "a header without a format line", "format ascii 1.0 or binary");
    header_.size = at_;
    header_.lines = line_;
    return std::move(header_);
  }

 private:
  [[noreturn]] void fail(std::string_view found, const std::string& expected) const {
    throw_invalid(at_line(path_, line_), "'" + escaped(found) + "'", expected);
  }

  std::string_view next() {
    const std::size_t end = content_.find('\n', at_);
    ++line_;
    if (end == std::string_view::npos)
      throw_invalid(at_line(path_, line_), "the end of the file", line_ == 1 ? "a PLY file" : "end_header");
    std::string_view line = content_.substr(at_, end - at_);
    at_ = end + 1;
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }

  void read_format(const std::vector<std::string_view>& fields) {
    const std::string_view name = fields.size() > 1 ? fields[1] : "";
    if (name == "ascii") {
      header_.encoding = Encoding::kAscii;
    } else if (name == "binary_little_endian") {
      header_.encoding = Encoding::kLittleEndian;
    } else if (name == "binary_big_endian") {
      header_.encoding = Encoding::kBigEndian;
    } else {
      fail(name, "ascii, binary_little_endian or binary_big_endian");
    }
    has_format_ = true;
  }

  void read_element(const std::vector<std::string_view>& fields) {
    if (fields.size() != 3) fail(fields.size() > 1 ? fields[1] : "", "element NAME COUNT");
    const double count = parse_number(fields[2], at_line(path_, line_), "count");
    if (!(count >= 0 && count <= 4e9 && count == std::floor(count))) fail(fields[2], "a count of elements");
    header_.elements.push_back({std::string(fields[1]), static_cast<std::int64_t>(count), {}});
  }

  Number type_of(std::string_view name) const {
    const std::optional<Number> type = number_type(name);
    if (!type) fail(name, "a number type such as float, uchar, int");
    return *type;
  }

  void read_property(const std::vector<std::string_view>& fields) {
    if (header_.elements.empty()) fail("property", "an element before its properties");
    const bool list = fields.size() == 5 && fields[1] == "list";
    if (!list && fields.size() != 3) fail(fields.size() > 1 ? fields[1] : "", "property TYPE NAME");
    Property property;
    property.name = fields.back();
    property.type = type_of(fields[fields.size() - 2]);
    if (list) property.list_count = type_of(fields[2]);
    header_.elements.back().properties.push_back(std::move(property));
  }

  const std::filesystem::path& path_;
  std::string_view content_;
  std::size_t at_ = 0;
  int line_ = 0;
  bool has_format_ = false;
  Header header_;
};

/// The numbers behind the header, one after the other.
class Body {
 public:
  Body(const std::filesystem::path& path, std::string_view content, const Header& header)
      : path_(path),
        content_(content),
        encoding_(header.encoding),
        at_(header.size),
        line_(header.lines + 1) {}

  double number(Number type, const Property& property) {
    return encoding_ == Encoding::kAscii ? text_number(property) : binary_number(type, property);
  }

  /// "FILE:LINE" or "FILE: byte N" of what was read last.
  std::string where() const {
    return encoding_ == Encoding::kAscii ? at_line(path_, line_)
                                         : path_.string() + ": byte " + std::to_string(last_);
  }

  std::size_t bytes_left() const { return content_.size() - at_; }

 private:
  double binary_number(Number type, const Property& property) {
    const std::size_t size = size_of(type);
    last_ = at_;
    if (bytes_left() < size) throw_invalid(where(), "the end of the file", property.name);
    char bytes[8];
    std::memcpy(bytes, content_.data() + at_, size);
    const bool swap = (encoding_ == Encoding::kBigEndian) == (std::endian::native == std::endian::little);
    if (swap) std::reverse(bytes, bytes + size);
    at_ += size;
    return value_of(type, bytes);
  }

  double text_number(const Property& property) {
    while (at_ < content_.size() && is_space(content_[at_])) line_ += content_[at_++] == '\n';
    std::size_t end = at_;
    while (end < content_.size() && !is_space(content_[end])) ++end;
    if (end == at_) throw_invalid(where(), "the end of the file", property.name);
    const std::string_view word = content_.substr(at_, end - at_);
    at_ = end;
    return parse_number(word, where(), property.name);
  }

  static bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

  const std::filesystem::path& path_;
  std::string_view content_;
  Encoding encoding_;
  std::size_t at_;
  std::size_t last_ = 0;
  int line_;
};

class MeshReader {
 public:
  MeshReader(const std::filesystem::path& path, std::string_view content, const Header& header)
      : path_(path), header_(header), body_(path, content, header) {}

  Mesh read() {
    for (const Element& element : header_.elements) {
      check_size(element);
      if (element.properties.empty()) continue;  // nothing of them is in the file
      for (std::int64_t i = 0; i < element.count; ++i) read_one(element);
    }
    if (mesh_.points.empty()) throw_invalid(path_.string(), "no vertices", "an element vertex with x, y, z");
    check_indices();
    return std::move(mesh_);
  }

 private:
  /// A count that the file cannot hold is found before memory is asked for.
  void check_size(const Element& element) const {
    std::size_t least = 0;
    for (const Property& property : element.properties)
      least +=
          header_.encoding == Encoding::kAscii ? 2 : size_of(property.list_count.value_or(property.type));
    if (least > 0 && static_cast<double>(element.count - 1) * least > static_cast<double>(body_.bytes_left()))
      throw_invalid(path_.string(), std::to_string(body_.bytes_left()) + " bytes (cut off?)",
                    std::to_string(element.count) + " of element " + escaped(element.name));
    if (element.name != "vertex") return;
    for (const char* axis : {"x", "y", "z"})
      if (std::none_of(element.properties.begin(), element.properties.end(),
                       [&](const Property& p) { return p.name == axis && !p.list_count; }))
        throw_invalid(path_.string(), std::string("a vertex without ") + axis, "properties x, y, z");
  }

  void read_one(const Element& element) {
    const bool vertex = element.name == "vertex", face = element.name == "face";
    Eigen::Vector3d x = Eigen::Vector3d::Zero();
    for (const Property& property : element.properties) {
      if (property.list_count) {
        const bool corners = face && (property.name == "vertex_indices" || property.name == "vertex_index");
        read_list(property, corners);
        continue;
      }
      const double value = body_.number(property.type, property);
      if (!vertex || property.name.size() != 1 || property.name[0] < 'x' || property.name[0] > 'z') continue;
      if (!std::isfinite(value))
        throw_invalid(body_.where() + ": " + property.name, "a value that is not finite", "a number");
      x[property.name[0] - 'x'] = value;
    }
    if (vertex) mesh_.points.push_back(x);
  }

  void read_list(const Property& property, bool corners) {
    const double count = body_.number(*property.list_count, property);
    if (!(count >= 0))
      throw_invalid(body_.where() + ": " + property.name, std::to_string(count), "a length of 0 or more");
    std::array<std::uint32_t, 3> triangle{};
    for (int i = 0; i < count; ++i) {
      const double index = body_.number(property.type, property);
      if (!corners) continue;
      if (!(index >= 0 && index < 4294967295.0 && index == std::floor(index)))
        throw_invalid(body_.where() + ": " + property.name, std::to_string(index), "the number of a vertex");
      triangle[std::min(i, 2)] = static_cast<std::uint32_t>(index);
      if (i < 2) continue;
      mesh_.triangles.push_back(triangle);
      triangle[1] = triangle[2];
    }
  }

  /// At the end, since faces may stand before vertices.
  void check_indices() const {
    for (const auto& triangle : mesh_.triangles)
      for (const std::uint32_t index : triangle)
        if (index >= mesh_.points.size())
          throw_invalid(path_.string(), "a face with vertex " + std::to_string(index),
                        "vertices 0 to " + std::to_string(mesh_.points.size() - 1));
  }

  const std::filesystem::path& path_;
  const Header& header_;
  Body body_;
  Mesh mesh_;
};

}  // namespace

Mesh read_ply(const std::filesystem::path& path) {
  const std::string content = read_whole_file(path);
  const Header header = HeaderReader(path, content).read();
  return MeshReader(path, content, header).read();
}

}  // namespace roxel
