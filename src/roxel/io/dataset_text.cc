#include "roxel/io/dataset_text.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <optional>

#include "roxel/base/error.h"

namespace roxel {
namespace {

/// Bytes of the well-formed UTF-8 sequence at the start of `text`; 0 where there is none ([RFC 3629] §4).
std::size_t utf8_sequence_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  if (lead < 0x80) return 1;
  const std::size_t length = lead >= 0xC2 && lead <= 0xDF   ? 2
                             : (lead & 0xF0) == 0xE0        ? 3
                             : lead >= 0xF0 && lead <= 0xF4 ? 4
                                                            : 0;
  if (length == 0 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
  }
  const unsigned char second = byte(1);
  const bool overlong = (lead == 0xE0 && second < 0xA0) || (lead == 0xF0 && second < 0x90);
  const bool not_a_character = (lead == 0xED && second > 0x9F) || (lead == 0xF4 && second > 0x8F);
  return overlong || not_a_character ? 0 : length;
}

bool is_control(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte < 0x20 || byte == 0x7F;
}

bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// One fixed-width decimal number at `at`, or -1.
int digits(const std::string& text, std::size_t at, std::size_t count) {
  if (at + count > text.size()) return -1;
  int value = 0;
  for (std::size_t i = at; i < at + count; ++i) {
    if (text[i] < '0' || text[i] > '9') return -1;
    value = 10 * value + (text[i] - '0');
  }
  return value;
}

/// Minutes east of UTC that a zone suffix says: "Z", "+HH:MM", "+HHMM", "+HH".
std::optional<int> zone_minutes(const std::string& zone) {
  if (zone == "Z" || zone == "z") return 0;
  if (zone.size() < 3 || (zone[0] != '+' && zone[0] != '-')) return std::nullopt;
  const int hours = digits(zone, 1, 2);
  const std::string rest = zone.substr(3);
  const int minutes = rest.empty() ? 0 : digits(rest, rest[0] == ':', 2);
  const bool complete = rest.empty() || rest.size() == (rest[0] == ':' ? 3u : 2u);
  if (hours < 0 || hours > 23 || minutes < 0 || minutes > 59 || !complete) return std::nullopt;
  return (zone[0] == '-' ? -1 : 1) * (60 * hours + minutes);
}

std::optional<double> utc_seconds(const std::string& text) {
  namespace chrono = std::chrono;
  const bool shaped = text.size() > 16 && text[4] == '-' && text[7] == '-' &&
                      (text[10] == 'T' || text[10] == 't' || text[10] == ' ') && text[13] == ':';
  if (!shaped) return std::nullopt;
  const int year = digits(text, 0, 4), month = digits(text, 5, 2), day = digits(text, 8, 2);
  const int hour = digits(text, 11, 2), minute = digits(text, 14, 2);
  std::size_t at = 16;
  double second = 0;
  if (text[at] == ':') {
    const int whole = digits(text, at + 1, 2);
    if (whole < 0 || whole > 60) return std::nullopt;
    second = whole;
    at += 3;
    if (at < text.size() && text[at] == '.') {
      double scale = 0.1;
      for (++at; at < text.size() && digits(text, at, 1) >= 0; ++at, scale /= 10)
        second += scale * digits(text, at, 1);
    }
  }
  if (year < 0 || month < 0 || day < 0 || hour < 0 || hour > 23 || minute < 0 || minute > 59)
    return std::nullopt;
  const chrono::year_month_day date{chrono::year(year), chrono::month(static_cast<unsigned>(month)),
                                    chrono::day(static_cast<unsigned>(day))};
  const std::optional<int> zone = zone_minutes(text.substr(std::min(at, text.size())));
  if (!date.ok() || !zone) return std::nullopt;
  const double days = static_cast<double>(chrono::sys_days(date).time_since_epoch().count());
  return 86400.0 * days + 3600.0 * hour + 60.0 * (minute - *zone) + second;
}

}  // namespace

std::string escaped(std::string_view text, std::size_t limit) {
  std::string result;
  const bool cut = text.size() > limit;
  if (cut) text = text.substr(0, limit);
  while (!text.empty()) {
    const std::size_t length = utf8_sequence_length(text);
    if (length == 0 || is_control(text[0])) {
      char code[8];
      std::snprintf(code, sizeof code, "\\x%02x", static_cast<unsigned char>(text[0]));
      result += code;
      text.remove_prefix(1);
    } else {
      result += text.substr(0, length);
      text.remove_prefix(length);
    }
  }
  return cut ? result + "..." : result;
}

bool is_valid_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = utf8_sequence_length(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

void check_name(std::string_view name, const std::string& where) {
  if (!is_valid_utf8(name)) {
    throw_invalid(where, "name '" + escaped(name, 400) + "' with bytes that are not UTF-8", "a UTF-8 name");
  }
  if (std::any_of(name.begin(), name.end(), is_control)) {
    throw_invalid(where, "name '" + escaped(name, 400) + "' with control characters", "a plain name");
  }
}

std::string read_whole_file(const std::filesystem::path& path) {
  const std::string shown = escaped(path.string(), 4000);
  if (!std::filesystem::exists(path)) throw_invalid(shown, "no such file", "a readable file");
  if (!std::filesystem::is_regular_file(path)) throw_invalid(shown, "not a plain file", "a readable file");
  std::ifstream in(path, std::ios::binary);
  if (!in) throw_invalid(shown, "a file that cannot be opened", "a readable file");
  std::string content((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (in.bad()) throw IoError(shown + ": reading failed");
  if (content.empty()) throw_invalid(shown, "0 bytes", "a file with content");
  return content;
}

std::string kind_of_content(std::string_view content) {
  const std::string_view head = content.substr(0, 4096);
  const bool binary =
      std::any_of(head.begin(), head.end(), [](char c) { return is_control(c) && !is_space(c); });
  if (binary) return "binary data";
  const auto first = std::find_if_not(head.begin(), head.end(), is_space);
  return first != head.end() && (*first == '{' || *first == '[') ? "JSON" : "text";
}

std::string read_text_file(const std::filesystem::path& path, const std::string& expected) {
  std::string content = read_whole_file(path);
  if (const std::string kind = kind_of_content(content); kind != "text") {
    throw_invalid(escaped(path.string(), 4000), kind, expected);
  }
  return content;
}

std::vector<TextLine> split_lines(std::string_view content) {
  std::vector<TextLine> lines;
  while (!content.empty()) {
    const std::size_t end = content.find('\n');
    std::string_view line = content.substr(0, end);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    lines.push_back({static_cast<int>(lines.size()) + 1, line});
    content.remove_prefix(end == std::string_view::npos ? content.size() : end + 1);
  }
  return lines;
}

std::vector<std::string_view> split_fields(std::string_view line) {
  std::vector<std::string_view> fields;
  std::size_t at = 0;
  while (true) {
    while (at < line.size() && is_space(line[at])) ++at;
    if (at == line.size()) return fields;
    std::size_t end = at;
    while (end < line.size() && !is_space(line[end])) ++end;
    fields.push_back(line.substr(at, end - at));
    at = end;
  }
}

std::string at_line(const std::filesystem::path& file, int line) {
  return file.string() + ":" + std::to_string(line);
}

double parse_number(std::string_view text, const std::string& where, std::string_view field) {
  double value = std::numeric_limits<double>::quiet_NaN();
  std::string_view body = text;
  if (!body.empty() && body.front() == '+') body.remove_prefix(1);
  const auto [end, error] = std::from_chars(body.data(), body.data() + body.size(), value);
  if (error != std::errc() || end != body.data() + body.size() || !std::isfinite(value)) {
    throw_invalid(where + ": " + std::string(field), "'" + escaped(text) + "'", "a finite number");
  }
  return value;
}

int parse_int(std::string_view text, const std::string& where, std::string_view field) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) {
    throw_invalid(where + ": " + std::string(field), "'" + escaped(text) + "'", "a whole number");
  }
  return value;
}

std::vector<double> parse_numbers(const std::vector<std::string_view>& fields, std::size_t first,
                                  std::size_t count, const std::string& where, std::string_view field) {
  if (fields.size() < first + count) {
    throw_invalid(where + ": " + std::string(field),
                  std::to_string(fields.size() < first ? 0 : fields.size() - first) + " values",
                  std::to_string(count));
  }
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i) values.push_back(parse_number(fields[first + i], where, field));
  return values;
}

std::vector<double> parse_number_file(const std::filesystem::path& file, const std::string& content,
                                      std::string_view expected) {
  std::vector<double> values;
  for (const TextLine& line : split_lines(content)) {
    const std::vector<std::string_view> fields = split_fields(line.text);
    if (!fields.empty() && fields[0].front() == '#') continue;
    for (std::string_view field : fields)
      values.push_back(parse_number(field, at_line(file, line.number), expected));
  }
  return values;
}

double parse_utc_time(const std::string& text, const std::string& where) {
  const std::optional<double> seconds = utc_seconds(text);
  if (!seconds) {
    throw_invalid(where, "'" + escaped(text) + "'",
                  "an ISO 8601 time with its zone, like 2003-08-21T16:50:00Z");
  }
  return *seconds;
}

std::string format_utc_time(double seconds) {
  namespace chrono = std::chrono;
  const auto microseconds = static_cast<long long>(std::llround(seconds * 1e6));
  const chrono::sys_time<chrono::microseconds> time{chrono::microseconds(microseconds)};
  const auto day = chrono::floor<chrono::days>(time);
  const chrono::year_month_day date(day);
  const chrono::hh_mm_ss clock(time - day);
  char text[64];
  std::snprintf(text, sizeof text, "%04d-%02u-%02uT%02d:%02d:%02d", static_cast<int>(date.year()),
                static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                static_cast<int>(clock.hours().count()), static_cast<int>(clock.minutes().count()),
                static_cast<int>(clock.seconds().count()));
  std::string result = text;
  if (const auto fraction = clock.subseconds().count(); fraction != 0) {
    std::snprintf(text, sizeof text, ".%06lld", static_cast<long long>(fraction));
    result += text;
  }
  return result + "Z";
}

}  // namespace roxel
