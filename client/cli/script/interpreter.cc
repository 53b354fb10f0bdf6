#include "client/cli/script/interpreter.h"

#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "client/cli/failure.h"
#include "client/cli/rows/update_report.h"
#include "client/cli/run.h"
#include "client/cli/script/cursor.h"
#include "client/cli/script/expectation.h"
#include "client/cli/script/expression.h"
#include "client/cli/unknown_values.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

absl::Status at_end(Cursor& cursor) {
  cursor.skip_blanks();
  if (cursor.ended()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("expected the end of the line, found ", cursor.found()));
}

std::vector<std::string> texts_of(const std::vector<Word>& words) {
  std::vector<std::string> texts;
  texts.reserve(words.size());
  for (const Word& word : words) texts.push_back(word.text);
  return texts;
}

// Removes `-> NAME` from the end of `words` and returns the name. Returns an empty text if `words` has no `->`, and
// INVALID_ARGUMENT if a `->` is not followed by exactly one name.
absl::StatusOr<std::string> take_target(std::vector<Word>& words) {
  for (size_t i = 0; i < words.size(); ++i) {
    if (!words[i].bare || words[i].text != "->") continue;
    if (i + 2 != words.size() || !is_name(words[i + 1].text)) {
      return absl::InvalidArgumentError("`-> NAME` stores a result and must end the line");
    }
    std::string name = words[i + 1].text;
    words.resize(i);
    return name;
  }
  return std::string();
}

absl::StatusOr<uint64_t> integer_up_to(const Value& value, uint64_t limit, absl::string_view what) {
  ASSIGN_OR_RETURN(const Number number, number_of(value));
  const absl::int128* const integer = std::get_if<absl::int128>(&number);
  if (integer == nullptr || *integer < 0 || *integer > absl::int128(limit)) {
    return absl::InvalidArgumentError(
        absl::StrCat(what, " is an integer from 0 to ", limit, ", not ", text_of(number)));
  }
  return static_cast<uint64_t>(*integer);
}

}  // namespace

Interpreter::Interpreter(Context& context, Variables variables) : context_(context), variables_(std::move(variables)) {
  context_.keep_reports();
}

absl::Status Interpreter::execute(const Statement& statement) {
  switch (statement.verb) {
    case Verb::kLet:
      return mistake(let(statement.text));
    case Verb::kUse:
      return mistake(use(statement.text));
    case Verb::kBegin:
      return mistake(begin(statement.text));
    case Verb::kExpect:
      return mistake(expect(statement.text));
    case Verb::kEcho:
      return mistake(echo(statement.text));
    case Verb::kSleep:
      return mistake(sleep(statement.text));
    case Verb::kCommit:
      return commit(statement);
    case Verb::kCommand:
      return command(statement);
    case Verb::kRepeat:
    case Verb::kEnd:
      break;
  }
  return absl::InternalError("the runner must handle repeat and end");
}

absl::Status Interpreter::mistake(const absl::Status& status) const {
  if (status.ok()) return status;
  return checks_only() ? usage_error(status.message()) : absl::FailedPreconditionError(status.message());
}

absl::Status Interpreter::set(const std::string& name, Value value) {
  return variables_.set(name, checks_only() && loops_ > 0 ? Value::unknown() : std::move(value));
}

absl::StatusOr<Value> Interpreter::read_value(const std::string& text) const {
  Cursor cursor(text);
  ASSIGN_OR_RETURN(Value value, read_expression(cursor, variables_));
  RETURN_IF_ERROR(at_end(cursor));
  return value;
}

absl::Status Interpreter::let(const std::string& text) {
  Cursor cursor(text);
  const std::string name = cursor.read_name();
  cursor.skip_blanks();
  if (name.empty() || !cursor.accept("=")) return absl::InvalidArgumentError("expected `let NAME = EXPRESSION`");
  absl::StatusOr<Value> value = read_value(std::string(cursor.rest()));
  return value.ok() ? set(name, *std::move(value)) : value.status();
}

absl::Status Interpreter::use(const std::string& text) {
  ASSIGN_OR_RETURN(const std::vector<Word> words, read_words(text, variables_));
  if (words.size() != 1) return absl::InvalidArgumentError("expected `use SCENE`");
  context_.use_scene(words.front().text);
  return absl::OkStatus();
}

absl::Status Interpreter::begin(const std::string& text) {
  ASSIGN_OR_RETURN(const std::vector<Word> words, read_words(text, variables_));
  const bool with_tick = words.size() == 2 && words.front().text == "--tick";
  if (!words.empty() && !with_tick) return absl::InvalidArgumentError("expected `begin` or `begin --tick N`");
  uint64_t tick = 0;
  const bool known = !has_unknown(texts_of(words));
  if (with_tick && known && !absl::SimpleAtoi(words[1].text, &tick)) {
    return absl::InvalidArgumentError(absl::StrCat("a tick is an integer from 0, not ", words[1].text));
  }
  in_batch_ = true;
  if (!checks_only()) context_.pending_batch().emplace(with_tick ? std::optional<uint64_t>(tick) : std::nullopt);
  return absl::OkStatus();
}

absl::Status Interpreter::commit(const Statement& statement) {
  in_batch_ = false;
  absl::StatusOr<std::vector<Word>> words = read_words(statement.text, variables_);
  if (!words.ok()) return mistake(words.status());
  const absl::StatusOr<std::string> target = take_target(*words);
  if (!target.ok()) return mistake(target.status());
  if (!words->empty()) return mistake(absl::InvalidArgumentError("expected `commit` or `commit -> NAME`"));
  absl::Status outcome;
  if (!checks_only()) {
    const PendingBatch pending = *std::exchange(context_.pending_batch(), std::nullopt);
    context_.take_report();
    outcome = pending.scene().empty() ? mistake(absl::InvalidArgumentError("the batch is empty"))
                                      : apply_and_report(pending.scene(), pending.batch(), context_);
  }
  if (!statement.reason.empty()) return verify_failure(statement.reason, outcome);
  return outcome.ok() && !target->empty() ? mistake(keep_result(*target)) : outcome;
}

absl::Status Interpreter::expect(const std::string& text) const {
  ASSIGN_OR_RETURN(const Expectation expectation, read_expectation(text, variables_));
  return checks_only() ? absl::OkStatus() : verify(expectation);
}

absl::Status Interpreter::echo(const std::string& text) {
  ASSIGN_OR_RETURN(const std::vector<Word> words, read_words(text, variables_));
  if (checks_only()) return absl::OkStatus();
  const std::string line = absl::StrJoin(texts_of(words), " ");
  if (context_.options().format == Format::kTable) {
    context_.out() << line << '\n';
  } else {
    Report report;
    report.head["echo"] = line;
    context_.write(report);
  }
  return absl::OkStatus();
}

absl::Status Interpreter::sleep(const std::string& text) const {
  const absl::StatusOr<Value> value = read_value(text);
  if (!value.ok() || !value->known()) return value.status();
  ASSIGN_OR_RETURN(const Number seconds, number_of(*value));
  if (real(seconds) < 0 || real(seconds) > kMaxSleepSeconds) {
    return absl::InvalidArgumentError(
        absl::StrCat("sleep takes 0 to ", kMaxSleepSeconds, " seconds, not ", text_of(seconds)));
  }
  if (!checks_only()) absl::SleepFor(absl::Seconds(real(seconds)));
  return absl::OkStatus();
}

absl::StatusOr<Repetition> Interpreter::read_repetition(const Statement& statement) const {
  Cursor cursor(statement.text);
  const absl::StatusOr<Value> times = read_expression(cursor, variables_);
  if (!times.ok()) return mistake(times.status());
  Repetition repetition;
  cursor.skip_blanks();
  if (cursor.accept("as ")) {
    cursor.skip_blanks();
    repetition.counter = cursor.read_name();
    if (repetition.counter.empty()) return mistake(absl::InvalidArgumentError("expected `repeat N as NAME`"));
  }
  if (const absl::Status ended = at_end(cursor); !ended.ok()) return mistake(ended);
  if (!times->known()) return repetition;
  const absl::StatusOr<uint64_t> count = integer_up_to(*times, kMaxRepeats, "the number of repetitions");
  if (!count.ok()) return mistake(count.status());
  repetition.times = *count;
  return repetition;
}

absl::Status Interpreter::command(const Statement& statement) {
  absl::StatusOr<std::vector<Word>> words = read_words(statement.text, variables_);
  if (!words.ok()) return mistake(words.status());
  const absl::StatusOr<std::string> target = take_target(*words);
  if (!target.ok()) return mistake(target.status());
  if (!target->empty() && (!statement.reason.empty() || in_batch_)) {
    return mistake(absl::InvalidArgumentError("there is no result to store: write `-> NAME` behind commit, not here"));
  }
  context_.take_report();
  const absl::Status outcome = run_script_line(texts_of(*words), context_);
  if (!statement.reason.empty()) return verify_failure(statement.reason, outcome);
  if (!outcome.ok() || target->empty()) return outcome;
  return mistake(keep_result(*target));
}

absl::Status Interpreter::keep_result(const std::string& name) {
  if (checks_only()) return set(name, Value::unknown());
  std::shared_ptr<const Report> report = context_.take_report();
  if (report == nullptr) return absl::InvalidArgumentError("this command has no result to store");
  return set(name, Value::of(std::move(report)));
}

absl::Status Interpreter::verify_failure(const std::string& reason, const absl::Status& outcome) const {
  if (checks_only()) return reason == "USAGE" ? absl::OkStatus() : outcome;
  if (outcome.ok()) return absl::FailedPreconditionError(absl::StrCat("expected ", reason, ", but it succeeded"));
  const std::string found = failure_name(outcome);
  if (found == reason) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("expected ", reason, ", but it is ", found, ": ", outcome.message()));
}

}  // namespace locus::cli
