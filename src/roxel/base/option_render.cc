#include <algorithm>

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

std::string markdown_row(const OptionField& field) {
  const std::string value = field.is_switch() ? "" : " " + placeholder_of(field);
  const std::string unit = field.unit.empty() ? "" : " (" + field.unit + ")";
  std::string row = "|";
  // "--no-adaptive | on" would leave the reader to guess which of the two is on.
  const bool negated = field.is_switch() && field.default_value == OptionValue(true);
  const std::string at_first = negated ? field.name + " is on" : field.default_text();
  for (const std::string& cell :
       {"`" + field.flag() + value + "`", at_first,
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
