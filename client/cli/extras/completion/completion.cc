#include "client/cli/extras/completion/completion.h"

#include "client/cli/extras/completion/shell_scripts.h"

namespace locus::cli {

std::string completion_script(const CommandWords& program, Shell shell) {
  switch (shell) {
    case Shell::kBash:
      return bash_script(program);
    case Shell::kZsh:
      return zsh_script(program);
    case Shell::kFish:
      return fish_script(program);
  }
  return "";
}

}  // namespace locus::cli
