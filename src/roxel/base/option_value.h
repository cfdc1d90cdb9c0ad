#pragma once
/// What the parts of the option table share; not for use elsewhere. Values of fields from text and JSON, and
/// whether they are legal.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "roxel/base/option_field.h"

namespace roxel::internal {

/// The value that text or JSON holds for this field, whatever its range; nothing where it is of another type.
std::optional<OptionValue> parse_text(const OptionField& field, const std::string& text);
std::optional<OptionValue> parse_json(const OptionField& field, const nlohmann::json& node);
void value_to_json(const OptionValue& value, nlohmann::json& json);

/// Whether a value of the right type is legal.
bool is_legal(const OptionField& field, const OptionValue& value);

/// "in (0, 1]", "> 0", or empty where there is no limit.
std::string range_text(const OptionField& field);

std::string join(const std::vector<std::string>& parts, const std::string& between);

}  // namespace roxel::internal
