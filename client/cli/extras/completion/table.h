// Table of all completion candidates, in lines of four fields separated by tabs: kind, word, kind of value,
// description. For the scripts of the three shells, which differ only in how they quote it.
//
//   command     ray     -                  Ask what rays hit
//   option      --mode  choice first any   Which hits ...
//   option      --json  -                  (a flag takes no value)
//   positional  SCENE   scene              The scene
//
// A kind of value is `any`, `file`, `scene`, `address`, or `choice` or `list` with the words after it.
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

// Returns an entry for each command. Its lines include the options of the commands above it.
std::vector<TableEntry> completion_table(const CommandWords& program);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_TABLE_H_
