#pragma once
/// One field of an OptionTable: what is known about it, and how it is declared.

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <variant>
#include <vector>

namespace roxel {

/// The value of a field apart from its C++ type; monostate is an optional left unset, a choice is its name.
using OptionValue =
    std::variant<std::monostate, bool, std::int64_t, double, std::string, std::vector<double>>;

enum class OptionKind { kSwitch, kInteger, kNumber, kText, kChoice, kNumbers };

/// All that is known about one field. `get` and `set` take the options struct that the table was made for.
struct OptionField {
  std::string name;         ///< long name without dashes, as in JSON: "voxel-size"
  std::string group;        ///< heading in help and docs
  std::string help;         ///< one line, no full stop
  std::string unit;         ///< empty for plain numbers
  std::string source;       ///< where the default comes from; may be empty
  std::string placeholder;  ///< what stands for the value in help: "NUMBER", "a|b"
  std::string unset_text;   ///< for optional fields: what happens when left out, e.g. "from the cameras"
  OptionKind kind = OptionKind::kText;
  bool optional = false;
  bool or_file = false;              ///< on the command line, numbers may stand in a file whose name is given
  std::size_t count = 1;             ///< how many numbers, for kNumbers
  std::vector<std::string> choices;  ///< legal names, for kChoice
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false, high_open = false;  ///< whether the ends of [low, high] are left out
  std::int64_t type_low = std::numeric_limits<std::int64_t>::min();
  std::int64_t type_high = std::numeric_limits<std::int64_t>::max();  ///< what the C++ integer can hold
  std::function<bool(const OptionValue&)> accepts;                    ///< further check; may be empty
  std::string accepts_text;                                           ///< what `accepts` wants, for messages
  OptionValue default_value;
  std::function<OptionValue(const void* options)> get;
  std::function<void(void* options, const OptionValue&)> set;

  bool is_switch() const { return kind == OptionKind::kSwitch; }
  /// The spelling that changes the default, with dashes: "--voxel-size", "--interpolate", "--no-adaptive".
  std::string flag() const;
  /// What a legal value is, for messages and docs: "a number in (0, 1]", "one of posterior, roxels".
  std::string expected() const;
  /// The default as text; `unset_text` (or "automatic") for an optional that is unset.
  std::string default_text() const;
};

/// A value as it is written on the command line: "0.5", "true", "1,2,3"; "auto" for monostate.
std::string to_text(const OptionValue& value);

/// Completes a field's declaration; every call returns the same object.
class OptionDeclaration {
 public:
  explicit OptionDeclaration(OptionField& field) : field_(field) {}
  OptionDeclaration& help(std::string text);
  OptionDeclaration& unit(std::string text);
  OptionDeclaration& source(std::string text);
  OptionDeclaration& placeholder(std::string text);
  /// A list of numbers may be given as the name of a text file that holds them.
  OptionDeclaration& or_file();
  /// What an optional field left out means, e.g. "from the cameras and points".
  OptionDeclaration& unset(std::string text);
  /// Ranges are for integers, numbers and each entry of a list of numbers.
  OptionDeclaration& range(double low, double high);  ///< low <= value <= high
  OptionDeclaration& at_least(double low);            ///< value >= low
  OptionDeclaration& at_most(double high);            ///< value <= high
  OptionDeclaration& above(double low);               ///< value > low
  OptionDeclaration& below(double high);              ///< value < high
  /// A further check of a value that is set; `expected` completes "expected ...".
  OptionDeclaration& check(std::string expected, std::function<bool(const OptionValue&)> accepts);

 private:
  OptionField& field_;
};

}  // namespace roxel
