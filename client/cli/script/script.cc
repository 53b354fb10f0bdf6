#include "client/cli/script/script.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "client/cli/failure.h"
#include "client/cli/script/script_limits.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr char kExpectError[] = "expect-error";

const std::map<std::string, Verb>& verbs() {
  static const auto& table =
      *new std::map<std::string, Verb>{{"let", Verb::kLet},       {"use", Verb::kUse},       {"begin", Verb::kBegin},
                                       {"commit", Verb::kCommit}, {"repeat", Verb::kRepeat}, {"end", Verb::kEnd},
                                       {"expect", Verb::kExpect}, {"echo", Verb::kEcho},     {"sleep", Verb::kSleep}};
  return table;
}

// Removes the first word, and the blanks after this word, from `text`. Returns the word.
std::string take_first_word(absl::string_view& text) {
  const size_t end = std::min(text.find_first_of(" \t"), text.size());
  std::string word(text.substr(0, end));
  text = absl::StripLeadingAsciiWhitespace(text.substr(end));
  return word;
}

absl::Status check_characters(absl::string_view line) {
  if (line.size() > kMaxLineBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("the line has ", line.size(), " bytes, at most ", kMaxLineBytes, " are allowed"));
  }
  for (const char c : line) {
    const auto code = static_cast<unsigned char>(c);
    if (absl::ascii_iscntrl(code) && c != '\t') {
      return absl::InvalidArgumentError(absl::StrCat("the line holds the control character ", static_cast<int>(code)));
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<Statement> parse_expect_error(absl::string_view rest) {
  Statement statement;
  statement.reason = take_first_word(rest);
  if (!is_failure_name(statement.reason)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "`", statement.reason, "` is not a failure: give a reason such as UNKNOWN_ID, a status code such as ",
        "DEADLINE_EXCEEDED, or USAGE"));
  }
  statement.text = std::string(rest);
  const std::string word = take_first_word(rest);
  if (word == "commit") {
    statement.verb = Verb::kCommit;
    statement.text = std::string(rest);
  } else if (word.empty() || word.front() == '#' || word == kExpectError || verbs().count(word) > 0) {
    return absl::InvalidArgumentError("expect-error REASON must be followed by a command or commit");
  }
  return statement;
}

// Parses a line. Returns nullopt for a line without a statement.
absl::StatusOr<std::optional<Statement>> parse_line(absl::string_view line) {
  line = absl::StripAsciiWhitespace(line);
  if (line.empty() || line.front() == '#') return std::nullopt;
  RETURN_IF_ERROR(check_characters(line));
  absl::string_view rest = line;
  const std::string word = take_first_word(rest);
  if (word == kExpectError) return parse_expect_error(rest);
  const auto verb = verbs().find(word);
  Statement statement;
  if (verb != verbs().end()) statement.verb = verb->second;
  statement.text = std::string(verb != verbs().end() ? rest : line);
  return statement;
}

bool fits_in_batch(const Statement& statement) {
  absl::string_view text = statement.text;
  const std::string word = take_first_word(text);
  return word == "insert" || word == "move" || word == "remove";
}

// Matcher of the beginnings and ends of blocks. It stores the open blocks. A batch may contain repeat blocks, and a
// repeat block may contain batches, but a batch may not contain a batch.
class Blocks {
 public:
  explicit Blocks(std::vector<Statement>& statements) : statements_(statements) {}

  absl::Status add(size_t place) {
    Statement& statement = statements_[place];
    switch (statement.verb) {
      case Verb::kBegin:
        if (batch_line_ != 0) return in_batch("begin");
        batch_line_ = statement.line;
        return open(place);
      case Verb::kRepeat:
        return open(place);
      case Verb::kCommit:
        batch_line_ = 0;
        return close(place, Verb::kBegin, "commit", "begin");
      case Verb::kEnd:
        return close(place, Verb::kRepeat, "end", "repeat");
      case Verb::kUse:
        return batch_line_ != 0 ? in_batch("use") : absl::OkStatus();
      case Verb::kCommand:
        if (batch_line_ == 0 || (fits_in_batch(statement) && statement.reason.empty())) return absl::OkStatus();
        return in_batch("this line");
      default:
        return absl::OkStatus();
    }
  }

  // Returns the index of the statement that opened the innermost open block; nullopt if all blocks are closed.
  std::optional<size_t> left_open() const { return open_.empty() ? std::nullopt : std::optional<size_t>(open_.back()); }

 private:
  absl::Status in_batch(absl::string_view what) const {
    return absl::InvalidArgumentError(
        absl::StrCat(what, " is not allowed in the batch that begins in line ", batch_line_,
                     ": until commit, only insert, move, remove, let, repeat, expect, echo and sleep are allowed"));
  }

  absl::Status open(size_t place) {
    if (open_.size() >= kMaxBlockNesting) {
      return absl::InvalidArgumentError(absl::StrCat("more than ", kMaxBlockNesting, " nested blocks"));
    }
    open_.push_back(place);
    return absl::OkStatus();
  }

  absl::Status close(size_t place, Verb opener, absl::string_view closing, absl::string_view opening) {
    if (open_.empty()) return absl::InvalidArgumentError(absl::StrCat("`", closing, "` without `", opening, "`"));
    const size_t partner = open_.back();
    if (statements_[partner].verb != opener) {
      return absl::InvalidArgumentError(absl::StrCat("`", closing, "` while the block of line ",
                                                     statements_[partner].line, " is open: close that one first"));
    }
    open_.pop_back();
    statements_[partner].partner = place;
    statements_[place].partner = partner;
    return absl::OkStatus();
  }

  std::vector<Statement>& statements_;
  std::vector<size_t> open_;
  size_t batch_line_ = 0;  // line of the open batch's begin; 0 = no batch is open
};

absl::Status wrong(const std::string& name, size_t line, const absl::Status& status) {
  return usage_error(absl::StrCat(name, ":", line, ": ", status.message()));
}

}  // namespace

std::string place_of(const Script& script, const Statement& statement) {
  return absl::StrCat(script.name, ":", statement.line);
}

absl::StatusOr<Script> parse_script(const std::string& name, absl::string_view text) {
  if (text.size() > kMaxScriptBytes) {
    return usage_error(
        absl::StrCat(name, ": a script has at most ", kMaxScriptBytes, " bytes, this has ", text.size()));
  }
  Script script{.name = name, .statements = {}};
  Blocks blocks(script.statements);
  size_t number = 0;
  for (const absl::string_view line : absl::StrSplit(text, '\n')) {
    if (++number > kMaxScriptLines) {
      return usage_error(absl::StrCat(name, ": a script has at most ", kMaxScriptLines, " lines"));
    }
    absl::StatusOr<std::optional<Statement>> statement = parse_line(line);
    if (!statement.ok()) return wrong(name, number, statement.status());
    if (!*statement) continue;
    (*statement)->line = number;
    script.statements.push_back(**std::move(statement));
    const absl::Status added = blocks.add(script.statements.size() - 1);
    if (!added.ok()) return wrong(name, number, added);
  }
  if (const std::optional<size_t> open = blocks.left_open()) {
    const Statement& statement = script.statements[*open];
    const bool batch = statement.verb == Verb::kBegin;
    return wrong(name, statement.line,
                 absl::InvalidArgumentError(batch ? "`begin` without `commit`" : "`repeat` without `end`"));
  }
  return script;
}

}  // namespace locus::cli
