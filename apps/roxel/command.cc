#include "command.h"

#include <CLI/CLI.hpp>
#include <cstdio>

#include "roxel/base/error.h"

namespace roxel::cli {
namespace {

constexpr int kMostInputs = 1 << 20;

bool takes_many(const CommandForm& form) { return form.input.ends_with("..."); }

/// CLI11's errors in the words of this program, on one line.
[[noreturn]] void throw_usage(const CommandForm& form, const std::string& message) {
  throw InvalidInput(message + "; see roxel " + form.name + " --help");
}

/// What CLI11 did not know: the first unknown option, or the first input too many.
[[noreturn]] void throw_unknown(const CommandForm& form, const std::deque<OptionField>& fields,
                                const std::vector<std::string>& unknown) {
  for (const std::string& argument : unknown) {
    if (argument.size() < 2 || argument[0] != '-') continue;
    if (argument[1] != '-') throw_usage(form, "\"" + argument + "\" is no option");
    struct Nothing {};
    internal::OptionTableCore known;
    known.fields = fields;
    Nothing nothing;
    const std::string name = argument.substr(2);
    known.set(&nothing, name.substr(0, name.find('=')), "", "");  // throws with the names that are near
  }
  throw_usage(form, "\"" + unknown.front() + "\" was not expected");
}

/// CLI11 says "--passes: 1 required  missing"; this program says what was found and expected.
[[noreturn]] void throw_parse_error(const CommandForm& form, const CLI::ParseError& error) {
  const std::string message = error.what();
  const std::string option = message.substr(0, message.find(':'));
  if (error.get_name() == "ArgumentMismatch" && option.starts_with("-"))
    throw_usage(form, option + ": found no value, expected one");
  throw_usage(form, message);
}

void check_inputs(const CommandForm& form, const std::vector<std::string>& inputs) {
  if (inputs.empty()) throw_usage(form, form.input + " is missing");
  if (inputs.size() > 1 && !takes_many(form))
    throw_usage(form, "found \"" + inputs[1] + "\" after \"" + inputs[0] + "\", expected one " + form.input);
}

/// CLI11 takes "--switch=" for "--switch".
void check_switches(const CommandForm& form, const std::deque<OptionField>& fields,
                    const std::vector<std::string>& arguments) {
  for (const OptionField& field : fields)
    for (const std::string& flag : {"--" + field.name, "--no-" + field.name})
      for (const std::string& argument : arguments)
        if (field.is_switch() && (argument == flag + "=" || argument == flag + "={}"))
          throw_usage(form, flag + ": found \"" + argument + "\", expected true or false");
}

void declare(CLI::App& app, const std::deque<OptionField>& fields,
             std::map<const CLI::Option*, std::string>& names) {
  for (const OptionField& field : fields) {
    if (field.is_switch()) {
      names[app.add_flag("--" + field.name)] = field.name;
      names[app.add_flag("--no-" + field.name)] = "no-" + field.name;
    } else {
      names[app.add_option("--" + field.name)
                ->expected(1)
                ->allow_extra_args(false)
                ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast)] = field.name;
    }
  }
}

std::string joined(const std::string& command, const std::vector<std::string>& arguments) {
  std::string line = "roxel " + command;
  for (const std::string& argument : arguments) {
    const bool plain =
        !argument.empty() && argument.find_first_of(" \t\n\"'*?[]$&;|<>()\\`!") == std::string::npos;
    line += plain ? " " + argument : " '" + argument + "'";
  }
  return line;
}

}  // namespace

ParsedLine parse_line(const CommandForm& form, const std::deque<OptionField>& fields,
                      const std::vector<std::string>& arguments) {
  ParsedLine parsed;
  parsed.invocation.line = joined(form.name, arguments);
  CLI::App app;
  app.set_help_flag();
  app.allow_extras();
  check_switches(form, fields, arguments);
  std::map<const CLI::Option*, std::string> names;
  declare(app, fields, names);
  app.add_flag("-h,--help", parsed.help);
  app.add_option("--config", parsed.config)->expected(1)->allow_extra_args(false);
  std::string output;
  if (!form.output.empty()) app.add_option("-o,--output", output)->expected(1)->allow_extra_args(false);
  auto* inputs = app.add_option("inputs", parsed.invocation.inputs);
  inputs->expected(0, kMostInputs);
  try {
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::ParseError& error) {
    throw_parse_error(form, error);
  }
  if (parsed.help) return parsed;
  if (!app.remaining().empty()) throw_unknown(form, fields, app.remaining());
  check_inputs(form, parsed.invocation.inputs);
  parsed.invocation.output = output;
  if (output.empty() && !form.output.empty() && form.output_required)
    throw_usage(form, "-o " + form.output + " is missing");
  for (const CLI::Option* option : app.parse_order()) {
    const auto name = names.find(option);
    if (name == names.end()) continue;
    parsed.options.emplace_back(name->second, option->results().back());  // "true" for a bare switch
  }
  return parsed;
}

std::string usage(const CommandForm& form) {
  std::string text = "Usage: roxel " + form.name + " " + form.input;
  if (!form.output.empty()) text += form.output_required ? " -o " + form.output : " [-o " + form.output + "]";
  text += " [options]\n\n" + form.summary + ".\n";
  if (!form.details.empty()) text += "\n" + form.details;
  return text;
}

void Command::print_help() const {
  std::printf(
      "%s\n%s\n  --config FILE                   Options by their long names from a JSON object; what the "
      "line "
      "says overrides it\n  --help                          This text\n",
      usage(form_).c_str(), options_help().c_str());
}

}  // namespace roxel::cli
