// The table in a completion script: what there is to complete, in lines of four fields divided by tabs. For the scripts
// of the three shells, which differ only in how they quote it.
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
  std::string path;                // of the command: "locus query ray"
  std::vector<std::string> lines;  // without ends of lines
};

// An entry for each command; the options of the commands above are among its lines.
std::vector<TableEntry> completion_table(const CommandWords& program);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_COMPLETION_TABLE_H_
