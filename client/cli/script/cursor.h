// Reading position in a line of a script, shared by the functions that parse expressions and words. Borrows the text.
// The cursor advances only past text that was parsed, so after an error it stands at the text that could not be parsed.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_CURSOR_H_
#define LOCUS_CLIENT_CLI_SCRIPT_CURSOR_H_

#include <string>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "client/cli/script/script_limits.h"
#include "client/cli/script/variables.h"

namespace locus::cli {

class Cursor {
 public:
  explicit Cursor(absl::string_view text) : text_(text) {}

  size_t at() const { return at_; }
  void move_to(size_t at) { at_ = at; }
  bool ended() const { return at_ >= text_.size(); }
  // Returns the next character, or 0 at the end. No line contains a character 0.
  char peek(size_t ahead = 0) const { return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0'; }
  char next() { return text_[at_++]; }
  absl::string_view rest() const { return text_.substr(at_); }
  absl::string_view since(size_t begin) const { return text_.substr(begin, at_ - begin); }

  // Advances past `token` if the text at the cursor begins with `token`. Returns whether it does.
  bool accept(absl::string_view token) {
    const bool found = absl::StartsWith(rest(), token);
    if (found) at_ += token.size();
    return found;
  }

  // Skips blanks. If a comment follows, removes it, so that the line ends where the comment begins.
  void skip_blanks() {
    while (peek() == ' ' || peek() == '\t') ++at_;
    if (peek() == '#') text_ = text_.substr(0, at_);
  }

  // Reads a name. Returns an empty string if no name comes next.
  std::string read_name() {
    const size_t begin = at_;
    if (begins_name(peek())) {
      while (continues_name(peek())) ++at_;
    }
    return std::string(since(begin));
  }

  // Returns the text at the cursor, for messages.
  std::string found() const {
    return ended() ? "the end of the line" : absl::StrCat("`", rest().substr(0, kShownBytes), "`");
  }

  // Counts the open brackets and quotes and returns an error beyond kMaxExpressionDepth, so that recursion is bounded.
  // Each call of open() needs a call of close().
  absl::Status open() {
    if (++depth_ <= kMaxExpressionDepth) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat("nested deeper than ", kMaxExpressionDepth));
  }
  void close() { --depth_; }

 private:
  static constexpr size_t kShownBytes = 30;

  absl::string_view text_;
  size_t at_ = 0;
  int depth_ = 0;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_CURSOR_H_
