#include <algorithm>
#include <sstream>

#include "roxel/base/option_table.h"
#include "roxel/base/option_value.h"

namespace roxel::internal {
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

bool is_on_at_first(const OptionField& field) {
  return field.is_switch() && field.default_value == OptionValue(true);
}

std::string markdown_row(const OptionField& field) {
  const std::string value = field.is_switch() ? "" : " " + placeholder_of(field);
  const std::string unit = field.unit.empty() ? "" : " (" + field.unit + ")";
  std::string row = "|";
  // "--no-adaptive | on" would leave the reader to guess which of the two is on.
  const std::string at_first = is_on_at_first(field) ? field.name + " is on" : field.default_text();
  for (const std::string& cell :
       {"`" + field.flag() + value + "`", at_first,
        field.is_switch() ? std::string() : field.expected() + unit, field.help, field.source})
    row += " " + markdown_cell(cell) + " |";
  return row + "\n";
}

/// What the flag does; a switch that is on at first is turned off by its flag.
std::string effect(const OptionField& field) {
  return is_on_at_first(field) ? "Turn off: " + field.help : field.help;
}

/// Breaks lines between words, `width` columns at most where words allow it; further lines are indented.
std::string wrapped(const std::string& text, std::size_t indent, std::size_t width) {
  std::istringstream words(text);
  std::string lines;
  std::size_t column = indent;
  for (std::string word; words >> word;) {
    const bool first = column == indent;
    const bool fits = first || column + 1 + word.size() <= width;
    if (!fits) lines += "\n" + std::string(indent, ' ');
    if (fits && !first) lines += ' ';
    column = (fits ? column + (first ? 0 : 1) : indent) + word.size();
    lines += word;
  }
  return lines;
}

std::string help_entry(const OptionField& field) {
  constexpr std::size_t kIndent = 34, kWidth = 100;
  const std::string margin = "\n" + std::string(kIndent, ' ');
  std::string entry = "  " + field.flag();
  if (!field.is_switch()) entry += " " + placeholder_of(field);
  entry += entry.size() + 2 > kIndent ? margin : std::string(kIndent - entry.size(), ' ');
  entry += wrapped(effect(field), kIndent, kWidth);
  if (field.is_switch()) return entry + "\n";
  std::vector<std::string> notes;
  if (!field.unit.empty()) notes.push_back(field.unit);
  const std::string range = field.accepts_text.empty() ? range_text(field) : field.accepts_text;
  if (!range.empty()) notes.push_back(range);
  notes.push_back("default: " + field.default_text());
  return entry + margin + wrapped("[" + join(notes, "; ") + "]", kIndent, kWidth) + "\n";
}

}  // namespace

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

}  // namespace roxel::internal
