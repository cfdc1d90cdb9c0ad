#include "roxel/base/option_table.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <stdexcept>

#include "roxel/base/error.h"
#include "roxel/base/option_value.h"

namespace roxel::internal {
namespace {

using nlohmann::json;

std::string quoted(const std::string& text) { return "\"" + text + "\""; }

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

/// What a short text file holds, as it would be written on the command line: "1,2,3".
std::string numbers_in(const std::string& file) {
  std::ifstream in(file);
  if (!in) throw IoError(file + ": cannot be read");
  constexpr int kMostCharacters = 4096;
  std::string content(kMostCharacters, '\0');
  in.read(content.data(), kMostCharacters);
  content.resize(static_cast<std::size_t>(in.gcount()));
  std::replace(content.begin(), content.end(), ',', ' ');
  std::istringstream words(content);
  std::vector<std::string> numbers{std::istream_iterator<std::string>(words), {}};
  return join(numbers, ",");
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
  if (!value && field->or_file && std::filesystem::is_regular_file(text)) {
    const std::string numbers = numbers_in(text);
    value = parse_text(*field, numbers);
    if (!value || !is_legal(*field, *value))
      throw_invalid(place(where, name) + ": " + text, quoted(numbers),
                    std::to_string(field->count) + " numbers, apart by blanks, commas or new lines");
  }
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
  std::error_code error;
  if (!std::filesystem::exists(file, error) && !error)
    throw_invalid(file.string(), "no such file", "a JSON object of options");
  std::ifstream in(file);
  if (!in) throw IoError(file.string() + ": cannot be read");
  apply_json(options, parse_without_repeated_keys(in, file.string()), file.string());
}

void OptionTableCore::to_json(const void* options, json& out) const {
  out = json::object();
  for (const OptionField& field : fields) value_to_json(field.get(options), out[field.name]);
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

}  // namespace roxel::internal
