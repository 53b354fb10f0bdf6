// Reader of the lines of a shell: with editing, history and completion on a terminal (libedit), else line by line. One
// thread.
#ifndef LOCUS_CLIENT_CLI_SHELL_LINE_READER_H_
#define LOCUS_CLIENT_CLI_SHELL_LINE_READER_H_

#include <functional>
#include <istream>
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"

namespace locus::cli {

// Returns the words that could stand for the last word of a line.
using Complete = std::function<std::vector<std::string>(absl::string_view line)>;

enum class LineEnd { kLine, kDropped, kEnded };

class LineReader {
 public:
  virtual ~LineReader() = default;

  // Reads a line, without its newline, behind `prompt`. Returns kDropped if the user pressed Ctrl-C, and kEnded at the
  // end of the input.
  virtual LineEnd read(const std::string& prompt, std::string& line) = 0;
  // Adds an input to the history, unless it is empty or equals the last one.
  virtual void remember(const std::string& input) = 0;

  // Returns a reader of the terminal on standard input and output. `history_path` is the file in which lines are kept,
  // readable only by the user; empty = they are not kept.
  static std::unique_ptr<LineReader> of_terminal(std::string history_path, Complete complete);
  // Returns a reader of `in`, which writes no prompt and keeps no history. Borrows `in`.
  static std::unique_ptr<LineReader> of_stream(std::istream& in);
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SHELL_LINE_READER_H_
