#include "roxel/base/option_value.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

namespace roxel::internal {
namespace {

using nlohmann::json;

bool in_range(const OptionField& field, double number) {
  const bool above = field.low_open ? number > field.low : number >= field.low;
  const bool below = field.high_open ? number < field.high : number <= field.high;
  return std::isfinite(number) && above && below;
}

bool is_choice(const OptionField& field, const std::string& text) {
  return std::find(field.choices.begin(), field.choices.end(), text) != field.choices.end();
}

/// Parses all of `text`; from_chars rather than strtod, so that the locale does not matter.
template <class Number>
std::optional<Number> parse_number(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::optional<OptionValue> parse_switch(const std::string& text) {
  for (const char* yes : {"", "true", "on", "1", "yes"})
    if (text == yes) return true;
  for (const char* no : {"false", "off", "0", "no"})
    if (text == no) return false;
  return std::nullopt;
}

/// Numbers between commas; blanks around them do not matter.
std::optional<OptionValue> parse_numbers(const std::string& text) {
  std::vector<double> numbers;
  std::istringstream in(text + ",");
  for (std::string piece; std::getline(in, piece, ',');) {
    const std::size_t first = piece.find_first_not_of(' ');
    const std::size_t last = piece.find_last_not_of(' ');
    if (first == std::string::npos) return std::nullopt;
    const auto number = parse_number<double>(std::string_view(piece).substr(first, last - first + 1));
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

template <class Number>
std::optional<OptionValue> as_value(const std::optional<Number>& number) {
  return number ? std::optional<OptionValue>(*number) : std::nullopt;
}

std::optional<OptionValue> integer_from_json(const json& node) {
  if (node.is_number_unsigned() && node.get<std::uint64_t>() > std::numeric_limits<std::int64_t>::max())
    return std::nullopt;
  if (node.is_number_integer()) return node.get<std::int64_t>();
  return std::nullopt;
}

std::optional<OptionValue> numbers_from_json(const json& node) {
  if (!node.is_array()) return std::nullopt;
  std::vector<double> numbers;
  for (const json& entry : node) {
    if (!entry.is_number()) return std::nullopt;
    numbers.push_back(entry.get<double>());
  }
  return numbers;
}

}  // namespace

std::optional<OptionValue> parse_text(const OptionField& field, const std::string& text) {
  if (field.optional && text == "auto") return OptionValue{};
  switch (field.kind) {
    case OptionKind::kSwitch:
      return parse_switch(text);
    case OptionKind::kInteger:
      return as_value(parse_number<std::int64_t>(text));
    case OptionKind::kNumber:
      return as_value(parse_number<double>(text));
    case OptionKind::kNumbers:
      return parse_numbers(text);
    case OptionKind::kText:
    case OptionKind::kChoice:
      return text;
  }
  return std::nullopt;
}

std::optional<OptionValue> parse_json(const OptionField& field, const json& node) {
  if (field.optional && (node.is_null() || node == "auto")) return OptionValue{};
  switch (field.kind) {
    case OptionKind::kSwitch:
      return node.is_boolean() ? std::optional<OptionValue>(node.get<bool>()) : std::nullopt;
    case OptionKind::kInteger:
      return integer_from_json(node);
    case OptionKind::kNumber:
      return node.is_number() ? std::optional<OptionValue>(node.get<double>()) : std::nullopt;
    case OptionKind::kNumbers:
      return numbers_from_json(node);
    case OptionKind::kText:
    case OptionKind::kChoice:
      return node.is_string() ? std::optional<OptionValue>(node.get<std::string>()) : std::nullopt;
  }
  return std::nullopt;
}

void value_to_json(const OptionValue& value, json& out) {
  out = std::visit(
      [](const auto& held) -> json {
        if constexpr (std::is_same_v<std::decay_t<decltype(held)>, std::monostate>) {
          return nullptr;
        } else {
          return held;
        }
      },
      value);
}

bool is_legal(const OptionField& field, const OptionValue& value) {
  if (std::holds_alternative<std::monostate>(value)) return field.optional;
  if (const auto* integer = std::get_if<std::int64_t>(&value)) {
    if (*integer < field.type_low || *integer > field.type_high) return false;
    if (!in_range(field, static_cast<double>(*integer))) return false;
  }
  if (const auto* number = std::get_if<double>(&value))
    if (!in_range(field, *number)) return false;
  if (const auto* numbers = std::get_if<std::vector<double>>(&value)) {
    if (numbers->size() != field.count) return false;
    for (const double number : *numbers)
      if (!in_range(field, number)) return false;
  }
  if (field.kind == OptionKind::kChoice && !is_choice(field, std::get<std::string>(value))) return false;
  return !field.accepts || field.accepts(value);
}

}  // namespace roxel::internal
