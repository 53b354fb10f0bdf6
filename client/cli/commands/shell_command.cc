// `locus shell`: a prompt for commands and Lua.
#include <memory>

#include "client/cli/commands.h"
#include "client/cli/shell/shell.h"

namespace locus::cli {
namespace {

struct ShellOptions {};

}  // namespace

void add_shell_command(CLI::App& parent, Context& context) {
  CLI::App& command = *parent.add_subcommand("shell", "Type commands and Lua at a prompt");
  command.footer(
      R"(A line whose first word is a command of locus runs as one; any other line is Lua with the module locus
(`locus run --help`). Tab completes, arrow keys and Ctrl-R find earlier lines, Ctrl-C ends a command, Ctrl-D the shell.

Examples:
  locus shell
  locus -a 127.0.0.1:7575 shell
  locus --context game shell)");
  run_when_chosen(command, std::make_shared<ShellOptions>(), context,
                  [](const ShellOptions&, Context& shell_context) { return run_shell({}, shell_context); });
}

}  // namespace locus::cli
