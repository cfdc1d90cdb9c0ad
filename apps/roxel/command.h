#pragma once
/// A subcommand: what its line looks like, which options it takes, and what it does. Options come from an
/// OptionTable, so that command line, --config, --help and the docs say the same.

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "roxel/base/option_table.h"

namespace roxel::cli {

/// What a command's line looks like apart from its options.
struct CommandForm {
  std::string name;
  std::string summary;      ///< one line, no full stop
  std::string input;        ///< name of what is read: "DATASET", "RUN"; "RUN..." for several
  std::string output = {};  ///< name of what -o takes: "RUN", "DIR"; empty = there is no -o
  bool output_required = true;
  std::string details = {};  ///< more for --help; whole lines
  bool hidden = false;       ///< not in the list of commands
};

/// What a command is run on.
struct Invocation {
  std::vector<std::string> inputs;
  std::filesystem::path output;  ///< empty where -o was not given
  std::string line;              ///< the whole command as it was given
};

/// A line taken apart, before options are set.
struct ParsedLine {
  Invocation invocation;
  bool help = false;
  std::string config;                                        ///< file of --config; empty = none
  std::vector<std::pair<std::string, std::string>> options;  ///< name and value, in the order given
};

/// Throws InvalidInput for unknown options, missing values, and too many or too few inputs.
ParsedLine parse_line(const CommandForm& form, const std::deque<OptionField>& fields,
                      const std::vector<std::string>& arguments);

/// "Usage: ..." and what the command does; options follow.
std::string usage(const CommandForm& form);

class Command {
 public:
  explicit Command(CommandForm form) : form_(std::move(form)) {}
  virtual ~Command() = default;
  const CommandForm& form() const { return form_; }
  virtual std::string options_help() const = 0;
  virtual std::string options_markdown() const = 0;
  /// Arguments after the command's name; returns the exit code.
  virtual int run(const std::vector<std::string>& arguments) const = 0;

 protected:
  void print_help() const;

 private:
  CommandForm form_;
};

/// A command with options of type S. Values of the command line override those of --config.
template <class S>
class TableCommand : public Command {
 public:
  using Run = int (*)(const Invocation&, const S& options);

  TableCommand(CommandForm form, OptionTable<S> table, Run job)
      : Command(std::move(form)), table_(std::move(table)), run_(job) {}

  std::string options_help() const override { return table_.help(); }
  std::string options_markdown() const override { return table_.markdown(); }

  int run(const std::vector<std::string>& arguments) const override {
    const ParsedLine line = parse_line(form(), table_.fields(), arguments);
    if (line.help) {
      print_help();
      return 0;
    }
    S options;
    if (!line.config.empty()) table_.apply_json_file(options, line.config);
    for (const auto& [name, text] : line.options) table_.set(options, name, text);
    table_.validate(options);
    return run_(line.invocation, options);
  }

 private:
  OptionTable<S> table_;
  Run run_;
};

using Commands = std::vector<std::unique_ptr<Command>>;

template <class S>
void add_command(Commands& commands, CommandForm form, OptionTable<S> table,
                 int (*run)(const Invocation&, const S&)) {
  commands.push_back(std::make_unique<TableCommand<S>>(std::move(form), std::move(table), run));
}

// One file each.
void add_info(Commands& commands);
void add_reconstruct(Commands& commands);
void add_sky(Commands& commands);
void add_depth(Commands& commands);
void add_render(Commands& commands);
void add_eval(Commands& commands);
void add_merge(Commands& commands);
void add_mesh(Commands& commands);
void add_synth(Commands& commands);
void add_convert(Commands& commands);

}  // namespace roxel::cli
