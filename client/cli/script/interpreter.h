// Interpreter of single statements: runs a statement, or checks it without running it. The runner chooses the
// statements. Not thread-safe.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_INTERPRETER_H_
#define LOCUS_CLIENT_CLI_SCRIPT_INTERPRETER_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/context.h"
#include "client/cli/script/script.h"
#include "client/cli/script/variables.h"
#include "client/cli/script/words.h"

namespace locus::cli {

// Parsed first line of a `repeat` block.
struct Repetition {
  std::optional<uint64_t> times;  // nullopt: unknown, because the script is only checked
  std::string counter;            // variable that counts the rounds from 0; empty = none
};

class Interpreter {
 public:
  // If context.lines() is Lines::kScriptCheck, statements are only checked: nothing is sent or written, there are no
  // waits, and results are unknown.
  Interpreter(Context& context, Variables variables);

  // Runs or checks any statement except repeat and end. Returns the error of a failed command. For a line that cannot
  // be parsed or calculated, returns a usage error while checking and FAILED_PRECONDITION while running.
  absl::Status execute(const Statement& statement);

  absl::StatusOr<Repetition> read_repetition(const Statement& statement) const;
  absl::Status set(const std::string& name, Value value);

  // Mark the beginning and the end of a loop. While a script is checked, variables that are set inside a loop have
  // unknown values, because a later round of the loop may set them again.
  void enter_loop() { ++loops_; }
  void leave_loop() { --loops_; }

 private:
  absl::Status let(const std::string& text);
  absl::Status use(const std::string& text);
  absl::Status begin(const std::string& text);
  absl::Status commit(const Statement& statement);
  absl::Status expect(const std::string& text) const;
  absl::Status echo(const std::string& text);
  absl::Status sleep(const std::string& text) const;
  absl::Status command(const Statement& statement);
  absl::Status keep_result(const std::string& name);
  absl::Status verify_failure(const std::string& reason, const absl::Status& outcome) const;
  absl::StatusOr<Value> read_value(const std::string& text) const;
  // Converts an error into a usage error while the script is checked, and into FAILED_PRECONDITION while it runs.
  // Returns OK unchanged.
  absl::Status mistake(const absl::Status& status) const;
  bool checks_only() const { return context_.lines() == Lines::kScriptCheck; }

  Context& context_;
  Variables variables_;
  int loops_ = 0;
  bool in_batch_ = false;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_INTERPRETER_H_
