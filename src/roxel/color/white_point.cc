#include "roxel/color/white_point.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include "roxel/base/error.h"

namespace roxel {
namespace {

constexpr std::array<std::pair<const char*, WhitePoint>, 3> kNamed{
    {{"D65", kWhiteD65}, {"A", kWhiteA}, {"C", kWhiteC}}};

std::string upper_case(std::string text) {
  for (char& c : text)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return text;
}

std::optional<double> parse_number(const char* begin, const char* end) {
  double value = 0;
  const auto [rest, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || rest != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<WhitePoint> parse_chromaticity(const std::string& text) {
  const std::size_t comma = text.find(',');
  if (comma == std::string::npos) return std::nullopt;
  const char* begin = text.data();
  const auto x = parse_number(begin, begin + comma);
  const auto y = parse_number(begin + comma + 1, begin + text.size());
  if (!x || !y || *x <= 0 || *y <= 0 || *x + *y >= 1) return std::nullopt;
  return WhitePoint{*x, *y};
}

}  // namespace

WhitePoint parse_white_point(const std::string& text, const std::string& where) {
  const std::string name = upper_case(text);
  for (const auto& [known, white] : kNamed)
    if (name == known) return white;
  if (const auto white = parse_chromaticity(text)) return *white;
  throw_invalid(where, "'" + text + "'", "D65, A, C or x,y with 0 < x, 0 < y, x + y < 1");
}

std::string to_string(const WhitePoint& white) {
  for (const auto& [known, named] : kNamed)
    if (white == named) return known;
  char text[64];
  std::snprintf(text, sizeof text, "%.17g,%.17g", white.x, white.y);
  return text;
}

}  // namespace roxel
