#include <memory>
#include <sstream>

#include "client/cli/choices.h"
#include "client/cli/commands.h"
#include "client/cli/extras/completion/completion.h"
#include "client/cli/run.h"

namespace locus::cli {
namespace {

struct CompletionOptions {
  Shell shell = Shell::kBash;
};

// Writes a completion script. Builds a second parser and reads the commands from it, because the parser that is running
// this command is not passed to this function.
absl::Status completion(const CompletionOptions& options, Context& context) {
  std::ostringstream nowhere;
  Context unused(nowhere, nowhere, Progress::kSilent);
  CLI::App app;
  build_cli(app, unused);
  context.out() << completion_script(words_of(app), options.shell);
  return absl::OkStatus();
}

}  // namespace

void add_completion_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<CompletionOptions>();
  CLI::App& command = *parent.add_subcommand("completion", "Print a script by which a shell completes lines of locus");
  command.footer(R"(An installed locus brings the scripts along. For one that is not, or for the shell at hand:

Examples:
  source <(locus completion bash)
  locus completion zsh > ~/.zfunc/_locus
  locus completion fish > ~/.config/fish/completions/locus.fish)");
  const NamedValues<Shell> shells = {{"bash", Shell::kBash}, {"zsh", Shell::kZsh}, {"fish", Shell::kFish}};
  command.add_option("SHELL", options->shell, "bash, zsh or fish")->required()->transform(choices(shells));
  run_when_chosen(command, options, context, completion);
}

}  // namespace locus::cli
