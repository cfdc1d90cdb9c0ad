#pragma once
/// Small things that HTML and SVG are put together from.

#include <cstdint>
#include <string>
#include <string_view>

namespace roxel {

/// Text that may stand between tags and in quoted attributes: & < > " ' are written as references, bytes that
/// are not UTF-8 and control characters as U+FFFD.
std::string escape_markup(std::string_view text);

/// RFC 4648.
std::string base64(std::string_view bytes);

/// "data:TYPE;base64,...": a file inside a page.
std::string data_uri(std::string_view media_type, std::string_view bytes);

/// At most `digits` significant digits, without trailing zeros: "0.25", "1200", "3e-05".
std::string short_number(double value, int digits = 4);

/// "1 234 567", with thin spaces.
std::string grouped(std::int64_t value);

}  // namespace roxel
