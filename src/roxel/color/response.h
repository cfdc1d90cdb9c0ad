#pragma once
/// The response of an image file: how its stored values follow from linear light. Stored values and light are
/// 1 at display white; curves are odd, so that negative values of float files survive.

#include <cstdint>
#include <string>
#include <vector>

namespace roxel {

enum class ResponseCurve {
  kSrgb,    ///< IEC 61966-2-1, piecewise; what 8- and 16-bit files have unless told otherwise
  kLinear,  ///< stored = light; what float files have unless told otherwise
  kGamma,   ///< stored = light^(1/gamma)
};

struct Response {
  ResponseCurve curve = ResponseCurve::kSrgb;
  double gamma = 2.2;  ///< used by kGamma only; 0.1 to 10

  bool operator==(const Response&) const = default;
};

/// Reads "srgb", "linear" or "gamma:G"; throws InvalidInput otherwise, naming `where`.
Response parse_response(const std::string& text, const std::string& where = "response");
std::string to_string(const Response& response);

/// Light of a stored value, and its inverse.
float decode(const Response& response, float stored);
float encode(const Response& response, float light);

/// decode(i / (levels - 1)) for i = 0 ... levels - 1; 256 levels for 8-bit files, 65536 for 16-bit ones.
std::vector<float> decoding_table(const Response& response, int levels);

/// The nearest 8-bit code of a light, clamped to 0 ... 255; 0 for NaN.
std::uint8_t encode_8bit(const Response& response, float light);

}  // namespace roxel
