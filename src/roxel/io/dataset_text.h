#pragma once
/// Parsing that the data-set readers share: every failure is an InvalidInput that says where, what was found
/// and what was expected.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace roxel {

/// The text with bytes that are not valid UTF-8 and control characters written as \xNN, cut to `limit` bytes.
std::string escaped(std::string_view text, std::size_t limit = 60);

bool is_valid_utf8(std::string_view text);

/// Throws unless `name` is valid UTF-8 without control characters.
void check_name(std::string_view name, const std::string& where);

/// The whole file. Throws where it is missing, unreadable or has 0 bytes.
std::string read_whole_file(const std::filesystem::path& path);

/// The same for a file that must be plain text; throws where it looks binary, or like JSON.
std::string read_text_file(const std::filesystem::path& path, const std::string& expected);

/// What the bytes look like, for messages: "JSON", "text" or "binary data".
std::string kind_of_content(std::string_view content);

/// One line of a text file, without its end.
struct TextLine {
  int number = 0;  ///< 1-based
  std::string_view text;
};

/// Lines of `content`, also the empty ones; views into it.
std::vector<TextLine> split_lines(std::string_view content);

/// Whitespace-separated fields.
std::vector<std::string_view> split_fields(std::string_view line);

/// "FILE:LINE".
std::string at_line(const std::filesystem::path& file, int line);

/// A finite number. Throws InvalidInput at "WHERE: FIELD" for anything else, NaN and infinity too.
double parse_number(std::string_view text, const std::string& where, std::string_view field);

/// A whole number that fits in an int.
int parse_int(std::string_view text, const std::string& where, std::string_view field);

/// All fields of `fields` from `first` on, `count` of them, as finite numbers.
std::vector<double> parse_numbers(const std::vector<std::string_view>& fields, std::size_t first,
                                  std::size_t count, const std::string& where, std::string_view field);

/// Every number of a text file of numbers only (blank lines and lines that begin with '#' are skipped).
std::vector<double> parse_number_file(const std::filesystem::path& file, const std::string& content,
                                      std::string_view expected);

/// Seconds since 1970-01-01T00:00:00Z of an ISO 8601 time with a zone ("2003-08-21T16:50:00Z", "...+02:00").
double parse_utc_time(const std::string& text, const std::string& where);

/// The inverse, "2003-08-21T16:50:00Z"; fractions of a second to the microsecond where there are some.
std::string format_utc_time(double seconds);

}  // namespace roxel
