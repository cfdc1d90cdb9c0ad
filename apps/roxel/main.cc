/// roxel COMMAND ...: finds the command, runs it, and turns errors into one line and an exit code.

#include <cstdio>
#include <new>
#include <set>
#include <sstream>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "command.h"
#include "roxel/base/error.h"
#include "roxel/solve/options.h"

namespace roxel::cli {
namespace {

enum ExitCode { kDone = 0, kFailed = 1, kBadInput = 2, kInterrupted = 130 };

Commands make_commands() {
  Commands commands;
  add_info(commands);
  add_reconstruct(commands);
  add_sky(commands);
  add_depth(commands);
  add_mesh(commands);
  add_render(commands);
  add_eval(commands);
  add_merge(commands);
  add_synth(commands);
  add_convert(commands);
  return commands;
}

std::string overview(const Commands& commands) {
  std::string text = "Usage: roxel COMMAND ...\n\nCalibrated photographs to a probabilistic volume.\n\n";
  for (const auto& command : commands) {
    std::string name = "  " + command->form().name;
    name.resize(16, ' ');
    text += name + command->form().summary + "\n";
  }
  return text + "\nroxel COMMAND --help explains a command, roxel --version names the program.\n";
}

/// A table of options under one heading.
struct OptionGroup {
  std::string name, table;
};

std::vector<OptionGroup> groups_of(const std::string& markdown) {
  std::vector<OptionGroup> groups;
  std::istringstream lines(markdown);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("### "))
      groups.push_back({line.substr(4), ""});
    else if (!groups.empty() && !line.empty())
      groups.back().table += line + "\n";
  }
  return groups;
}

/// The end of docs/commands.md: each table once; those of reconstruct have their own page.
void print_markdown(const Commands& commands) {
  std::printf("## Options\n\nMade by `roxel help-markdown`; a test compares.\n");
  std::set<std::string> known;
  for (const OptionGroup& group : groups_of(reconstruct_option_table().markdown())) known.insert(group.name);
  for (const auto& command : commands) {
    std::string list;
    for (const OptionGroup& group : groups_of(command->options_markdown())) {
      list += (list.empty() ? "" : ", ") + group.name;
      if (known.insert(group.name).second)
        std::printf("\n### %s\n\n%s", group.name.c_str(), group.table.c_str());
    }
    std::printf("\n`roxel %s` takes: %s.\n", command->form().name.c_str(), list.c_str());
  }
}

int run(const std::vector<std::string>& arguments) {
  const Commands commands = make_commands();
  if (arguments.empty()) {
    std::fputs(overview(commands).c_str(), stderr);
    return kBadInput;
  }
  const std::string& name = arguments.front();
  if (name == "help" && arguments.size() == 2) return run({arguments[1], "--help"});
  if (name == "--help" || name == "-h" || name == "help")
    return std::fputs(overview(commands).c_str(), stdout), kDone;
  if (name == "--version") return std::printf("roxel %s\n", ROXEL_VERSION), kDone;
  if (name == "help-markdown") return print_markdown(commands), kDone;
  std::string known;
  for (const auto& command : commands) {
    if (command->form().name == name) return command->run({arguments.begin() + 1, arguments.end()});
    known += (known.empty() ? "" : ", ") + command->form().name;
  }
  throw InvalidInput("unknown command \"" + name + "\", expected one of " + known);
}

/// The message on one line: exceptions of libraries may hold several.
int fail(const char* message, ExitCode code) {
  std::string line = message;
  while (!line.empty() && line.back() == '\n') line.pop_back();
  for (char& c : line)
    if (c == '\n' || c == '\r') c = ' ';
  std::fprintf(stderr, "roxel: error: %s\n", line.c_str());
  return code;
}

int guarded(const std::vector<std::string>& arguments) {
  try {
    const int code = run(arguments);
    if (std::fflush(stdout) != 0) return fail("standard output cannot be written", kFailed);
    return code;
  } catch (const InvalidInput& error) {
    return fail(error.what(), kBadInput);
  } catch (const Cancelled& error) {
    return fail(error.what(), kInterrupted);
  } catch (const std::bad_alloc&) {
    return fail("out of memory; roxel info says how much a run needs, --resolution reduces it", kFailed);
  } catch (const std::exception& error) {
    return fail(error.what(), kFailed);
  }
}

/// Images come and go by the hundred: memory of this much is kept for the next one, for what the system gets
/// back it hands out again page by page.
void keep_freed_memory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 128 << 20);
  mallopt(M_TOP_PAD, 16 << 20);
#endif
}

}  // namespace
}  // namespace roxel::cli

int main(int argc, char** argv) {
  roxel::cli::keep_freed_memory();
  return roxel::cli::guarded({argv + 1, argv + argc});
}
