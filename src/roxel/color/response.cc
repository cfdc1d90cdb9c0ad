#include "roxel/color/response.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "roxel/base/error.h"
#include "roxel/color/color_space.h"

namespace roxel {
namespace {

constexpr double kSmallestGamma = 0.1, kLargestGamma = 10;
const std::string kGammaPrefix = "gamma:";

float odd_power(float x, double exponent) {
  return static_cast<float>(std::copysign(std::pow(std::abs(static_cast<double>(x)), exponent), x));
}

}  // namespace

Response parse_response(const std::string& text, const std::string& where) {
  if (text == "srgb") return {ResponseCurve::kSrgb};
  if (text == "linear") return {ResponseCurve::kLinear};
  if (text.starts_with(kGammaPrefix)) {
    Response response{ResponseCurve::kGamma};
    const char* begin = text.data() + kGammaPrefix.size();
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(begin, end, response.gamma);
    if (error == std::errc() && stop == end && response.gamma >= kSmallestGamma &&
        response.gamma <= kLargestGamma)
      return response;
  }
  throw_invalid(where, "'" + text + "'", "srgb, linear or gamma:G with G from 0.1 to 10");
}

std::string to_string(const Response& response) {
  if (response.curve == ResponseCurve::kSrgb) return "srgb";
  if (response.curve == ResponseCurve::kLinear) return "linear";
  std::ostringstream out;
  out << kGammaPrefix << response.gamma;
  return out.str();
}

float decode(const Response& response, float stored) {
  switch (response.curve) {
    case ResponseCurve::kSrgb:
      return srgb_decode(stored);
    case ResponseCurve::kLinear:
      return stored;
    case ResponseCurve::kGamma:
      return odd_power(stored, response.gamma);
  }
  return stored;
}

float encode(const Response& response, float light) {
  switch (response.curve) {
    case ResponseCurve::kSrgb:
      return srgb_encode(light);
    case ResponseCurve::kLinear:
      return light;
    case ResponseCurve::kGamma:
      return odd_power(light, 1 / response.gamma);
  }
  return light;
}

std::vector<float> decoding_table(const Response& response, int levels) {
  ROXEL_CHECK_GE(levels, 2);
  std::vector<float> table(levels);
  for (int i = 0; i < levels; ++i) table[i] = decode(response, static_cast<float>(i / (levels - 1.0)));
  return table;
}

std::uint8_t encode_8bit(const Response& response, float light) {
  if (std::isnan(light)) return 0;
  const float stored = std::clamp(encode(response, std::clamp(light, 0.0f, 1.0f)), 0.0f, 1.0f);
  return static_cast<std::uint8_t>(std::lround(255 * stored));
}

}  // namespace roxel
