#pragma once
/// One table says everything about a set of options: a field is declared once, beside the struct that holds
/// it, and the command line, JSON files, the summary of a run and the docs are all made from that line.
///
///   struct Options { double voxel_size = 0.1; bool adaptive = true; std::optional<double> near; };
///
///   OptionTable<Options> table;
///   table.group("Volume");
///   table.add("voxel-size", &Options::voxel_size).help("Edge of the finest voxel").unit("world
///   units").above(0); table.add("adaptive", &Options::adaptive).help("Sample where the image has detail");
///   table.add("near", &Options::near).help("Nearest distance").above(0).unset("from the cameras");
///
/// Text and JSON are checked when they are read; `validate` checks what code has set. Every error is an
/// InvalidInput that names the field, the value and what was expected. NaN and infinity are never legal.

#include <array>
#include <concepts>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "roxel/base/option_field.h"

namespace roxel {

namespace internal {

/// How a member type is read and written; specialised for all types that a field may have.
template <class T>
struct OptionTraits;

template <>
struct OptionTraits<bool> {
  static void describe(OptionField& field) { field.kind = OptionKind::kSwitch; }
  static OptionValue get(bool value) { return value; }
  static void set(bool& target, const OptionValue& value) { target = std::get<bool>(value); }
};

template <std::integral T>
requires(!std::same_as<T, bool>) struct OptionTraits<T> {
  static void describe(OptionField& field) {
    field.kind = OptionKind::kInteger;
    field.type_low = std::is_signed_v<T> ? static_cast<std::int64_t>(std::numeric_limits<T>::min()) : 0;
    if (std::in_range<std::int64_t>(std::numeric_limits<T>::max()))
      field.type_high = static_cast<std::int64_t>(std::numeric_limits<T>::max());
  }
  static OptionValue get(T value) { return static_cast<std::int64_t>(value); }
  static void set(T& target, const OptionValue& value) {
    target = static_cast<T>(std::get<std::int64_t>(value));
  }
};

template <std::floating_point T>
struct OptionTraits<T> {
  static void describe(OptionField& field) { field.kind = OptionKind::kNumber; }
  static OptionValue get(T value) { return static_cast<double>(value); }
  static void set(T& target, const OptionValue& value) { target = static_cast<T>(std::get<double>(value)); }
};

template <>
struct OptionTraits<std::string> {
  static void describe(OptionField& field) { field.kind = OptionKind::kText; }
  static OptionValue get(const std::string& value) { return value; }
  static void set(std::string& target, const OptionValue& value) { target = std::get<std::string>(value); }
};

template <std::size_t N>
struct OptionTraits<std::array<double, N>> {
  static void describe(OptionField& field) {
    field.kind = OptionKind::kNumbers;
    field.count = N;
  }
  static OptionValue get(const std::array<double, N>& value) {
    return std::vector<double>(value.begin(), value.end());
  }
  static void set(std::array<double, N>& target, const OptionValue& value) {
    const auto& numbers = std::get<std::vector<double>>(value);
    for (std::size_t i = 0; i < N; ++i) target[i] = numbers.at(i);
  }
};

template <class T>
struct OptionTraits<std::optional<T>> {
  static void describe(OptionField& field) {
    OptionTraits<T>::describe(field);
    field.optional = true;
  }
  static OptionValue get(const std::optional<T>& value) {
    return value ? OptionTraits<T>::get(*value) : OptionValue{};
  }
  static void set(std::optional<T>& target, const OptionValue& value) {
    if (std::holds_alternative<std::monostate>(value)) return target.reset();
    OptionTraits<T>::set(target.emplace(), value);
  }
};

/// The table apart from the type of its struct. Options pass through as untyped pointers; OptionTable<S>
/// sees to it that they point to an S.
class OptionTableCore {
 public:
  using Rule = std::function<std::string(const void* options)>;

  OptionField& add(OptionField field);
  void set(void* options, const std::string& name, const std::string& text, const std::string& where) const;
  void apply_json(void* options, const nlohmann::json& json, const std::string& where) const;
  void apply_json_file(void* options, const std::filesystem::path& file) const;
  void to_json(const void* options, nlohmann::json& json) const;
  void validate(const void* options, const std::string& where) const;
  std::string markdown() const;
  std::string help() const;

  std::string current_group = "Options";
  std::deque<OptionField> fields;
  std::vector<Rule> rules;

 private:
  /// The field of this name and, for "no-NAME" of a switch, that the value is to be negated.
  std::pair<const OptionField*, bool> look_up(const std::string& name, const std::string& where) const;
};

}  // namespace internal

/// Members that fields may bind to: bool, integers, double, float, std::string, std::array<double, N>,
/// std::optional of those, and enums (with the names of their values).
template <class S>
class OptionTable {
 public:
  template <class Access>
  using Member = std::remove_cvref_t<std::invoke_result_t<Access, S&>>;

  /// Defaults are what a default-constructed S holds.
  explicit OptionTable(S defaults = S{}) : defaults_(std::move(defaults)) {}

  /// Fields added from here on stand under this heading.
  void group(std::string heading) { core_.current_group = std::move(heading); }

  /// Declares a field. `access` is a pointer to a member of S, or a callable from S& to a reference, such as
  /// `[](S& s) -> double& { return s.pass.strength; }`. A name that is taken is a std::logic_error.
  template <class Access>
  OptionDeclaration add(std::string name, Access access) {
    using Traits = internal::OptionTraits<Member<Access>>;
    OptionField field = named(std::move(name));
    Traits::describe(field);
    field.get = [access](const void* s) { return Traits::get(std::invoke(access, mutable_options(s))); };
    field.set = [access](void* s, const OptionValue& value) {
      Traits::set(std::invoke(access, *static_cast<S*>(s)), value);
    };
    return declare(std::move(field));
  }

  /// Declares an enum with the names of its values, in the order of the docs.
  template <class Access>
  OptionDeclaration add(std::string name, Access access,
                        std::initializer_list<std::pair<const char*, Member<Access>>> choices) {
    using Choices = std::vector<std::pair<std::string, Member<Access>>>;
    OptionField field = named(std::move(name));
    field.kind = OptionKind::kChoice;
    for (const auto& choice : choices) field.choices.emplace_back(choice.first);
    const Choices known(choices.begin(), choices.end());
    field.get = [access, known](const void* s) -> OptionValue {
      for (const auto& [text, value] : known)
        if (std::invoke(access, mutable_options(s)) == value) return text;
      return std::string("(not a value of this enum)");
    };
    field.set = [access, known](void* s, const OptionValue& wanted) {
      for (const auto& [text, value] : known)
        if (text == std::get<std::string>(wanted)) std::invoke(access, *static_cast<S*>(s)) = value;
    };
    return declare(std::move(field));
  }

  /// Takes over all fields and rules of a table for a part of S, with their groups; `access` as in `add`.
  template <class T, class Access>
  void include(const OptionTable<T>& part, Access access) {
    for (OptionField field : part.fields()) {
      field.get = [access, get = field.get](const void* s) {
        return get(&std::invoke(access, mutable_options(s)));
      };
      field.set = [access, set = field.set](void* s, const OptionValue& value) {
        T& target = std::invoke(access, *static_cast<S*>(s));
        set(&target, value);
      };
      declare(std::move(field));
    }
    for (const auto& rule : part.rules())
      core_.rules.push_back(
          [access, rule](const void* s) { return rule(&std::invoke(access, mutable_options(s))); });
  }

  /// A law between fields: returns an empty string, or what is wrong ("near (3) must be below far (2)").
  void rule(std::function<std::string(const S&)> law) {
    core_.rules.push_back([law](const void* s) { return law(*static_cast<const S*>(s)); });
  }

  /// All fields in the order of declaration.
  const std::deque<OptionField>& fields() const { return core_.fields; }
  const std::vector<internal::OptionTableCore::Rule>& rules() const { return core_.rules; }

  /// Sets a field from text. Switches take true, false, on, off, 1, 0, or empty for true, and also the name
  /// "no-NAME"; "auto" unsets an optional. Unknown names and illegal values are InvalidInput; `where` opens
  /// the message and is "--NAME" if empty. `options` is unchanged when this throws.
  void set(S& options, const std::string& name, const std::string& text,
           const std::string& where = "") const {
    core_.set(&options, name, text, where);
  }

  /// Sets every field that the object names; null unsets an optional. `where` (the file) opens messages.
  /// `options` is unchanged when this throws.
  void apply_json(S& options, const nlohmann::json& json, const std::string& where) const {
    S changed = options;
    core_.apply_json(&changed, json, where);
    options = std::move(changed);
  }

  /// The same from a file. IoError where it cannot be read; InvalidInput where there is none, for a syntax
  /// error and for a key that stands there twice.
  void apply_json_file(S& options, const std::filesystem::path& file) const {
    S changed = options;
    core_.apply_json_file(&changed, file);
    options = std::move(changed);
  }

  /// All fields by name, as used; an unset optional is null. apply_json restores the same options from it.
  /// (A template only so that this header does not need the whole of nlohmann/json.hpp; callers do.)
  template <class Json = nlohmann::json>
  Json to_json(const S& options) const {
    Json json;
    core_.to_json(&options, json);
    return json;
  }

  /// Throws InvalidInput for the first field out of its range, or the first rule that does not hold.
  void validate(const S& options, const std::string& where = "") const { core_.validate(&options, where); }

  /// One Markdown table a group: option, default, range, meaning, source of the default.
  std::string markdown() const { return core_.markdown(); }

  /// Help for a terminal, under 100 columns where names allow it.
  std::string help() const { return core_.help(); }

 private:
  static S& mutable_options(const void* options) { return *static_cast<S*>(const_cast<void*>(options)); }

  OptionField named(std::string name) const {
    OptionField field;
    field.name = std::move(name);
    field.group = core_.current_group;
    return field;
  }

  OptionDeclaration declare(OptionField field) {
    field.default_value = field.get(&defaults_);
    return OptionDeclaration(core_.add(std::move(field)));
  }

  S defaults_;
  internal::OptionTableCore core_;
};

}  // namespace roxel
