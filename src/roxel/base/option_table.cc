#include "roxel/base/option_table.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "roxel/base/error.h"

namespace roxel {
namespace {

using nlohmann::json;

std::string quoted(const std::string& text) { return "\"" + text + "\""; }

std::string join(const std::vector<std::string>& parts, const std::string& between) {
  std::string all;
  for (const std::string& part : parts) all += (all.empty() ? "" : between) + part;
  return all;
}

/// The shortest text that reads back as the same number, whatever the locale.
std::string number_text(double number) {
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, number).ptr;
  return {buffer, end};
}

bool is_bounded(double end) { return std::isfinite(end); }

std::string range_text(const OptionField& field) {
  if (is_bounded(field.low) && is_bounded(field.high))
    return std::string("in ") + (field.low_open ? "(" : "[") + number_text(field.low) + ", " +
           number_text(field.high) + (field.high_open ? ")" : "]");
  if (is_bounded(field.low)) return (field.low_open ? "> " : ">= ") + number_text(field.low);
  if (is_bounded(field.high)) return (field.high_open ? "< " : "<= ") + number_text(field.high);
  return "";
}

std::string with_range(std::string what, const OptionField& field) {
  const std::string range = range_text(field);
  return range.empty() ? what : what + " " + range;
}

bool in_range(const OptionField& field, double number) {
  const bool above = field.low_open ? number > field.low : number >= field.low;
  const bool below = field.high_open ? number < field.high : number <= field.high;
  return std::isfinite(number) && above && below;
}

bool is_choice(const OptionField& field, const std::string& text) {
  return std::find(field.choices.begin(), field.choices.end(), text) != field.choices.end();
}

/// Whether a value of the right type is legal.
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

/// Insertions, deletions, substitutions and swaps of neighbours that turn one word into the other.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> cost(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i)
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        cost[i][j] = i + j;
        continue;
      }
      const std::size_t replaced = cost[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      cost[i][j] = std::min({cost[i - 1][j] + 1, cost[i][j - 1] + 1, replaced});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) cost[i][j] = std::min(cost[i][j], cost[i - 2][j - 2] + 1);
    }
  return cost[a.size()][b.size()];
}

/// Up to three known names that `name` may have been meant to be, the closest first.
std::vector<std::string> close_matches(const std::string& name, const std::deque<OptionField>& fields) {
  std::vector<std::pair<std::size_t, std::string>> near;
  for (const OptionField& field : fields) {
    const bool part = name.size() >= 3 && field.name.find(name) != std::string::npos;
    const std::size_t distance = part ? 1 : edit_distance(name, field.name);
    if (distance <= std::max<std::size_t>(2, field.name.size() / 3)) near.emplace_back(distance, field.name);
  }
  std::stable_sort(near.begin(), near.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::string> names;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, near.size()); ++i) names.push_back(near[i].second);
  return names;
}

/// "FILE: " before the name of a field, or the name as the command line has it.
std::string place(const std::string& where, const std::string& name) {
  return where.empty() ? "--" + name : where + ": " + quoted(name);
}

/// "--no-x auto" of an optional switch stays unset.
OptionValue negation(const OptionValue& value) {
  const bool* on = std::get_if<bool>(&value);
  return on ? OptionValue(!*on) : value;
}

json to_json_value(const OptionValue& value) {
  return std::visit(
      [](const auto& held) -> json {
        if constexpr (std::is_same_v<std::decay_t<decltype(held)>, std::monostate>)
          return nullptr;
        else
          return held;
      },
      value);
}

/// Reads a JSON document in which no object has a key twice (the parser alone would keep the last one).
json parse_without_repeated_keys(std::istream& in, const std::string& where) {
  std::vector<std::set<std::string>> open_objects;
  const auto watch = [&](int, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::object_start) open_objects.emplace_back();
    if (event == json::parse_event_t::object_end) open_objects.pop_back();
    if (event == json::parse_event_t::key && !open_objects.back().insert(parsed.get<std::string>()).second)
      throw_invalid(where + ": " + parsed.dump(), "the same key twice", "each key once");
    return true;
  };
  try {
    return json::parse(in, watch);
  } catch (const json::exception& error) {
    throw_invalid(where, std::string("a syntax error (") + error.what() + ")", "a JSON object of options");
  }
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
      return with_range(std::to_string(count) + " numbers", *this);
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
namespace {

std::string numbers_placeholder(std::size_t count) {
  std::string letters;
  for (std::size_t i = 0; i < count; ++i)
    letters += std::string(i ? "," : "") + static_cast<char>('A' + i % 26);
  return letters;
}

std::string default_placeholder(const OptionField& field) {
  switch (field.kind) {
    case OptionKind::kSwitch:
      return "";
    case OptionKind::kInteger:
      return "N";
    case OptionKind::kNumber:
      return "NUMBER";
    case OptionKind::kNumbers:
      return numbers_placeholder(field.count);
    case OptionKind::kText:
      return "TEXT";
    case OptionKind::kChoice:
      return join(field.choices, "|");
  }
  return "";
}

std::string placeholder_of(const OptionField& field) {
  return field.placeholder.empty() ? default_placeholder(field) : field.placeholder;
}

/// Headings in the order in which they first appear.
std::vector<std::string> groups_of(const std::deque<OptionField>& fields) {
  std::vector<std::string> groups;
  for (const OptionField& field : fields)
    if (std::find(groups.begin(), groups.end(), field.group) == groups.end()) groups.push_back(field.group);
  return groups;
}

std::string markdown_cell(const std::string& text) {
  std::string cell;
  for (const char c : text) {
    if (c == '|') cell += '\\';
    cell += c == '\n' ? ' ' : c;
  }
  return cell;
}

std::string markdown_row(const OptionField& field) {
  const std::string value = field.is_switch() ? "" : " " + placeholder_of(field);
  const std::string unit = field.unit.empty() ? "" : " (" + field.unit + ")";
  std::string row = "|";
  for (const std::string& cell :
       {"`" + field.flag() + value + "`", field.default_text(),
        field.is_switch() ? std::string() : field.expected() + unit, field.help, field.source})
    row += " " + markdown_cell(cell) + " |";
  return row + "\n";
}

std::string help_entry(const OptionField& field) {
  constexpr std::size_t kColumn = 34;
  std::string line = "  " + field.flag();
  if (!field.is_switch()) line += " " + placeholder_of(field);
  line +=
      line.size() + 2 > kColumn ? "\n" + std::string(kColumn, ' ') : std::string(kColumn - line.size(), ' ');
  line += field.help;
  if (field.is_switch()) return line + "\n";
  std::vector<std::string> notes;
  if (!field.unit.empty()) notes.push_back(field.unit);
  const std::string range = field.accepts_text.empty() ? range_text(field) : field.accepts_text;
  if (!range.empty()) notes.push_back(range);
  notes.push_back("default: " + field.default_text());
  return line + "\n" + std::string(kColumn, ' ') + "[" + join(notes, "; ") + "]\n";
}

}  // namespace

OptionField& OptionTableCore::add(OptionField field) {
  for (const OptionField& other : fields)
    if (other.name == field.name) throw std::logic_error("option \"" + field.name + "\" is declared twice");
  return fields.emplace_back(std::move(field));
}

std::pair<const OptionField*, bool> OptionTableCore::look_up(const std::string& name,
                                                             const std::string& where) const {
  for (const OptionField& field : fields) {
    if (field.name == name) return {&field, false};
    if (field.is_switch() && "no-" + field.name == name) return {&field, true};
  }
  const std::vector<std::string> close = close_matches(name, fields);
  throw_invalid(place(where, name), "an unknown option",
                close.empty() ? "the name of an option" : "perhaps " + join(close, " or "));
}

void OptionTableCore::set(void* options, const std::string& name, const std::string& text,
                          const std::string& where) const {
  const auto [field, negated] = look_up(name, where);
  std::optional<OptionValue> value = parse_text(*field, text);
  if (!value || !is_legal(*field, *value)) throw_invalid(place(where, name), quoted(text), field->expected());
  if (negated) value = negation(*value);
  field->set(options, *value);
}

void OptionTableCore::apply_json(void* options, const json& object, const std::string& where) const {
  if (!object.is_object()) throw_invalid(where, object.type_name(), "a JSON object of options");
  std::set<const OptionField*> seen;
  for (const auto& [name, node] : object.items()) {
    const auto [field, negated] = look_up(name, where);
    if (!seen.insert(field).second)
      throw_invalid(place(where, name), "a second value of the same option", "one");
    std::optional<OptionValue> value = parse_json(*field, node);
    if (!value || !is_legal(*field, *value))
      throw_invalid(place(where, name), node.dump(), field->expected());
    if (negated) value = negation(*value);
    field->set(options, *value);
  }
}

void OptionTableCore::apply_json_file(void* options, const std::filesystem::path& file) const {
  std::ifstream in(file);
  if (!in) throw IoError(file.string() + ": cannot be read");
  apply_json(options, parse_without_repeated_keys(in, file.string()), file.string());
}

void OptionTableCore::to_json(const void* options, json& out) const {
  out = json::object();
  for (const OptionField& field : fields) out[field.name] = to_json_value(field.get(options));
}

void OptionTableCore::validate(const void* options, const std::string& where) const {
  for (const OptionField& field : fields) {
    const OptionValue value = field.get(options);
    if (!is_legal(field, value)) throw_invalid(place(where, field.name), to_text(value), field.expected());
  }
  for (const Rule& rule : rules) {
    const std::string problem = rule(options);
    if (!problem.empty()) throw InvalidInput(where.empty() ? problem : where + ": " + problem);
  }
}

std::string OptionTableCore::markdown() const {
  std::string page;
  for (const std::string& group : groups_of(fields)) {
    page += (page.empty() ? "### " : "\n### ") + group + "\n\n";
    page += "| option | default | value | meaning | source of the default |\n|---|---|---|---|---|\n";
    for (const OptionField& field : fields)
      if (field.group == group) page += markdown_row(field);
  }
  return page;
}

std::string OptionTableCore::help() const {
  std::string text;
  for (const std::string& group : groups_of(fields)) {
    text += (text.empty() ? "" : "\n") + group + ":\n";
    for (const OptionField& field : fields)
      if (field.group == group) text += help_entry(field);
  }
  return text;
}

}  // namespace internal
}  // namespace roxel
