// The parser's commands and options as plain data, for what is written from them: completions and manual pages. One
// walk over the parser, so that nothing can say anything else than the program does. Plain data; throws nothing.
#ifndef LOCUS_CLIENT_CLI_COMMAND_WORDS_H_
#define LOCUS_CLIENT_CLI_COMMAND_WORDS_H_

#include <string>
#include <vector>

#include "CLI/CLI.hpp"

namespace locus::cli {

// What stands for an option's value, as far as a shell can help with it.
enum class ValueKind { kAnything, kChoice, kListOfChoices, kFile, kScene, kAddress };

struct OptionWords {
  std::vector<std::string> names = {};  // "-o", "--output"; a positional has none
  std::string value = {};               // "FORMAT", a positional's own name; empty for a flag
  ValueKind kind = ValueKind::kAnything;
  std::vector<std::string> choices = {};  // of the two kinds of choice
  std::string description = {};
  std::string default_text = {};  // empty where the description tells it, or there is none
  bool required = false;
  bool repeatable = false;
};

struct CommandWords {
  std::string path = {};  // "locus query ray"
  std::string description = {};
  std::string footer = {};  // what help shows last: notes and examples
  std::vector<OptionWords> options = {};
  std::vector<OptionWords> positionals = {};
  std::vector<CommandWords> commands = {};
};

// Everything below `app`, but not what is hidden (of the empty group). Options keep the order in which help shows them.
// A file is known by a value called FILE, OUT, DIRECTORY, BACKUP or DATA_DIR, a scene by SCENE, the server by ADDRESS.
CommandWords words_of(CLI::App& app);

// The option called `name` among those of the command, or nothing.
const OptionWords* find_option(const CommandWords& command, const std::string& name);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMAND_WORDS_H_
