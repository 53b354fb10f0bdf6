#include "client/cli/script/runner.h"

#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/failure.h"
#include "client/cli/script/interpreter.h"
#include "client/cli/script/script_limits.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

bool is_expectation(const Statement& statement) { return statement.verb == Verb::kExpect || !statement.reason.empty(); }

// Runner of all statements of a script, with loops.
class Runner {
 public:
  Runner(const Script& script, const Variables& variables, AfterFailure after, Context& context, ScriptCounts& counts)
      : script_(script), after_(after), context_(context), interpreter_(context, variables), counts_(counts) {}

  absl::Status run() {
    for (size_t next = 0; next < script_.statements.size();) {
      const Statement& statement = script_.statements[next];
      if (++counts_.lines > kMaxLinesRun) {
        return with_place(absl::ResourceExhaustedError(absl::StrCat("more than ", kMaxLinesRun, " lines have run")),
                          place_of(script_, statement));
      }
      const absl::StatusOr<size_t> following = step(next);
      RETURN_IF_ERROR(count(statement, following.status()));
      next = following.ok() ? *following : behind_failed(next);
    }
    return absl::OkStatus();
  }

 private:
  struct Loop {
    size_t begin;  // index of the repeat statement
    uint64_t done = 0;
    uint64_t times = 0;
    std::string counter;
  };

  // Runs the statement at index `place`. Returns the index of the next statement.
  absl::StatusOr<size_t> step(size_t place) {
    const Statement& statement = script_.statements[place];
    if (statement.verb == Verb::kRepeat) return enter(place);
    if (statement.verb == Verb::kEnd) return go_around(place);
    const absl::Status status = interpreter_.execute(statement);
    return status.ok() ? absl::StatusOr<size_t>(place + 1) : status;
  }

  // Returns the index of the statement with which the run continues after statement `place` failed. If the failed
  // statement opens a block, the whole block is skipped.
  size_t behind_failed(size_t place) const {
    const Statement& statement = script_.statements[place];
    const bool opens = statement.verb == Verb::kRepeat || statement.verb == Verb::kBegin;
    return (opens ? statement.partner : place) + 1;
  }

  absl::StatusOr<size_t> enter(size_t place) {
    const Statement& statement = script_.statements[place];
    ASSIGN_OR_RETURN(Repetition repetition, interpreter_.read_repetition(statement));
    const bool checks_only = context_.lines() == Lines::kScriptCheck;
    // A check runs every loop once.
    Loop loop{.begin = place, .times = checks_only ? 1 : *repetition.times, .counter = repetition.counter};
    if (loop.times == 0) return statement.partner + 1;
    interpreter_.enter_loop();
    const absl::Status set = count_up(loop);
    if (!set.ok()) {
      interpreter_.leave_loop();
      return set;
    }
    loops_.push_back(std::move(loop));
    return place + 1;
  }

  absl::StatusOr<size_t> go_around(size_t place) {
    Loop& loop = loops_.back();
    if (++loop.done < loop.times) {
      const absl::Status set = count_up(loop);
      return set.ok() ? absl::StatusOr<size_t>(loop.begin + 1) : set;
    }
    loops_.pop_back();
    interpreter_.leave_loop();
    return place + 1;
  }

  absl::Status count_up(const Loop& loop) {
    if (loop.counter.empty()) return absl::OkStatus();
    return interpreter_.set(loop.counter, Value::of(Json(loop.done)));
  }

  // Counts the result of a statement, and prints its error if there is one. Returns the error if the run must end.
  absl::Status count(const Statement& statement, const absl::Status& status) {
    if (is_expectation(statement)) ++(status.ok() ? counts_.passed : counts_.failed);
    if (status.ok()) return status;
    const absl::Status placed = with_place(status, place_of(script_, statement));
    if (context_.lines() == Lines::kScriptCheck) return placed;
    if (!is_expectation(statement)) ++counts_.broken;
    write_failure(context_.err(), context_.options().format, placed);
    const bool ends = after_ == AfterFailure::kStop || exit_code_of(status) == ExitCode::kUnreachable;
    return ends ? reported(placed) : absl::OkStatus();
  }

  const Script& script_;
  const AfterFailure after_;
  Context& context_;
  Interpreter interpreter_;
  ScriptCounts& counts_;
  std::vector<Loop> loops_;
};

}  // namespace

absl::Status check_script(const Script& script, const Variables& variables, Context& context, ScriptCounts& counts) {
  const std::string scene = context.default_scene();
  const Lines lines = context.lines();
  context.set_lines(Lines::kScriptCheck);
  const absl::Status status = Runner(script, variables, AfterFailure::kStop, context, counts).run();
  context.set_lines(lines);
  context.use_scene(scene);
  return status;
}

absl::Status run_script(const Script& script, const Variables& variables, AfterFailure after, Context& context,
                        ScriptCounts& counts) {
  const Lines lines = context.lines();
  context.set_lines(Lines::kScript);
  const absl::Status status = Runner(script, variables, after, context, counts).run();
  context.set_lines(lines);
  context.pending_batch().reset();
  RETURN_IF_ERROR(status);
  const uint64_t bad = counts.failed + counts.broken;
  return bad == 0 ? absl::OkStatus() : reported(absl::FailedPreconditionError(absl::StrCat(bad, " lines failed")));
}

}  // namespace locus::cli
