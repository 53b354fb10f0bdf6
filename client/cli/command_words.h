// Commands and options of the command-line parser as plain data. Shell completions and manual pages are written from
// this data. The data is read from the parser itself, so completions and manual pages always agree with the program.
// Throws nothing.
#ifndef LOCUS_CLIENT_CLI_COMMAND_WORDS_H_
#define LOCUS_CLIENT_CLI_COMMAND_WORDS_H_

#include <string>
#include <vector>

#include "CLI/CLI.hpp"

namespace locus::cli {

// Kind of an option's value; determines how a shell completes the value.
enum class ValueKind { kAnything, kChoice, kListOfChoices, kFile, kScene, kAddress };

struct OptionWords {
  std::vector<std::string> names = {};  // "-o", "--output"; empty for a positional argument
  std::string value = {};               // name of the value in the help, such as "FORMAT"; empty for a flag
  ValueKind kind = ValueKind::kAnything;
  std::vector<std::string> choices = {};  // allowed words of kChoice and kListOfChoices
  std::string description = {};
  std::string default_text = {};  // empty if the option has no default, or its description states the default
  bool required = false;
  bool repeatable = false;
};

struct CommandWords {
  std::string path = {};  // "locus query ray"
  std::string description = {};
  std::string footer = {};  // text after the options in the help: notes and examples
  std::vector<OptionWords> options = {};
  std::vector<OptionWords> positionals = {};
  std::vector<CommandWords> commands = {};
};

// Returns all commands and options of `app` except hidden ones (CLI11's group ""). Options have the order of the help
// text. ValueKind is derived from the value's name: FILE, OUT, DIRECTORY, BACKUP and DATA_DIR are files, SCENE is a
// scene, ADDRESS is a server.
CommandWords words_of(CLI::App& app);

// Returns the command's option called `name` (including its dashes), or null if the command has no such option.
const OptionWords* find_option(const CommandWords& command, const std::string& name);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMAND_WORDS_H_
