// Table of all completion candidates. A line has four fields separated by tabs: kind, word, kind of value, description.
// For the scripts of the three shells, which embed it with different quoting.
//
//   command     ray     -                  Ask what rays hit
//   option      --mode  choice first any   Which hits ...
//   option      --json  -                  (a flag takes no value)
//   positional  SCENE   scene              The scene
//
// The kind of value is `any`, `file`, `scene` or `address`, or it is `choice` or `list` followed by the allowed words.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_TABLE_H_
#define LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_TABLE_H_

#include <string>
#include <vector>

#include "client/cli/command_words.h"

namespace locus::cli {

struct TableEntry {
  std::string path;                // full name of the command: "locus query ray"
  std::vector<std::string> lines;  // without newlines
};

// Returns an entry for each command. The lines of an entry also contain the options of the commands above it.
std::vector<TableEntry> completion_table(const CommandWords& program);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_TABLE_H_
