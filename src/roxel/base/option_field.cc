#include "roxel/base/option_field.h"

#include <charconv>
#include <cmath>

#include "roxel/base/option_value.h"

namespace roxel {
namespace internal {

std::string join(const std::vector<std::string>& parts, const std::string& between) {
  std::string all;
  for (const std::string& part : parts) all += (all.empty() ? "" : between) + part;
  return all;
}

}  // namespace internal

namespace {

using internal::join;
using internal::range_text;

/// The shortest text that reads back as the same number, whatever the locale.
std::string number_text(double number) {
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, number).ptr;
  return {buffer, end};
}

bool is_bounded(double end) { return std::isfinite(end); }

std::string with_range(std::string what, const OptionField& field) {
  const std::string range = range_text(field);
  return range.empty() ? what : what + " " + range;
}

}  // namespace

std::string to_text(const OptionValue& value) {
  if (std::holds_alternative<std::monostate>(value)) return "auto";
  if (const auto* on = std::get_if<bool>(&value)) return *on ? "true" : "false";
  if (const auto* integer = std::get_if<std::int64_t>(&value)) return std::to_string(*integer);
  if (const auto* number = std::get_if<double>(&value)) return number_text(*number);
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  std::vector<std::string> numbers;
  for (const double number : std::get<std::vector<double>>(value)) numbers.push_back(number_text(number));
  return join(numbers, ",");
}

std::string OptionField::flag() const {
  const bool defaults_to_true = is_switch() && default_value == OptionValue(true);
  return (defaults_to_true ? "--no-" : "--") + name;
}

std::string OptionField::expected() const {
  if (!accepts_text.empty()) return accepts_text;
  switch (kind) {
    case OptionKind::kSwitch:
      return "true or false";
    case OptionKind::kInteger:
      return with_range("a whole number", *this);
    case OptionKind::kNumber:
      return with_range("a number", *this);
    case OptionKind::kNumbers:
      return with_range(std::to_string(count) + " numbers", *this) +
             (or_file ? ", or the name of a file that holds them" : "");
    case OptionKind::kText:
      return "text";
    case OptionKind::kChoice:
      return "one of " + join(choices, ", ");
  }
  return "";
}

std::string OptionField::default_text() const {
  if (std::holds_alternative<std::monostate>(default_value))
    return unset_text.empty() ? "automatic" : unset_text;
  if (is_switch()) return default_value == OptionValue(true) ? "on" : "off";
  return to_text(default_value);
}

OptionDeclaration& OptionDeclaration::help(std::string text) {
  field_.help = std::move(text);
  return *this;
}

OptionDeclaration& OptionDeclaration::unit(std::string text) {
  field_.unit = std::move(text);
  return *this;
}

OptionDeclaration& OptionDeclaration::source(std::string text) {
  field_.source = std::move(text);
  return *this;
}

OptionDeclaration& OptionDeclaration::placeholder(std::string text) {
  field_.placeholder = std::move(text);
  return *this;
}

OptionDeclaration& OptionDeclaration::or_file() {
  field_.or_file = true;
  return *this;
}

OptionDeclaration& OptionDeclaration::unset(std::string text) {
  field_.unset_text = std::move(text);
  return *this;
}

OptionDeclaration& OptionDeclaration::range(double low, double high) { return at_least(low).at_most(high); }

OptionDeclaration& OptionDeclaration::at_least(double low) {
  field_.low = low;
  field_.low_open = false;
  return *this;
}

OptionDeclaration& OptionDeclaration::at_most(double high) {
  field_.high = high;
  field_.high_open = false;
  return *this;
}

OptionDeclaration& OptionDeclaration::above(double low) {
  field_.low = low;
  field_.low_open = true;
  return *this;
}

OptionDeclaration& OptionDeclaration::below(double high) {
  field_.high = high;
  field_.high_open = true;
  return *this;
}

OptionDeclaration& OptionDeclaration::check(std::string expected,
                                            std::function<bool(const OptionValue&)> accepts) {
  field_.accepts_text = std::move(expected);
  field_.accepts = std::move(accepts);
  return *this;
}

namespace internal {

std::string range_text(const OptionField& field) {
  if (is_bounded(field.low) && is_bounded(field.high))
    return std::string("in ") + (field.low_open ? "(" : "[") + number_text(field.low) + ", " +
           number_text(field.high) + (field.high_open ? ")" : "]");
  if (is_bounded(field.low)) return (field.low_open ? "> " : ">= ") + number_text(field.low);
  if (is_bounded(field.high)) return (field.high_open ? "< " : "<= ") + number_text(field.high);
  return "";
}

}  // namespace internal
}  // namespace roxel
