// Runs one statement of a script, or checks it without running it. For the runner, which decides which comes next. Not
// thread-safe.
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

// The head of a `repeat`.
struct Repetition {
  std::optional<uint64_t> times;  // none while it is not known
  std::string counter;            // the variable that counts from 0; empty = none
};

class Interpreter {
 public:
  // context.lines() tells running from checking: then nothing is sent, written or waited for, and results are unknown.
  Interpreter(Context& context, Variables variables);

  // Any statement but repeat and end. A command that fails gives its own failure; a line that cannot be read or
  // calculated a usage error while checking, else FAILED_PRECONDITION.
  absl::Status execute(const Statement& statement);

  absl::StatusOr<Repetition> read_repetition(const Statement& statement) const;
  absl::Status set(const std::string& name, Value value);

  // While checking: what is set between the two is unknown from then on, since a loop may set it again.
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
  absl::Status judge_failure(const std::string& reason, const absl::Status& outcome) const;
  absl::StatusOr<Value> read_value(const std::string& text) const;
  // A mistake in the script itself.
  absl::Status mistake(const absl::Status& status) const;
  bool checks_only() const { return context_.lines() == Lines::kScriptCheck; }

  Context& context_;
  Variables variables_;
  int loops_ = 0;
  bool in_batch_ = false;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_INTERPRETER_H_
