#include "client/cli/shell/line_reader.h"

#include <sys/stat.h>

#include <algorithm>
#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/string_view.h"
#include "core/base/check.h"
#include "histedit.h"

namespace locus::cli {
namespace {

constexpr int kHistoryLines = 1000;
constexpr size_t kMaxShown = 100;  // candidates that are listed

// Returns the longest text with which all of `words` begin; `words` is not empty and sorted.
std::string common_prefix(const std::vector<std::string>& words) {
  const std::string& first = words.front();
  const std::string& last = words.back();
  const auto [end, unused] = std::mismatch(first.begin(), first.end(), last.begin(), last.end());
  return {first.begin(), end};
}

class TerminalReader final : public LineReader {
 public:
  TerminalReader(std::string history_path, Complete complete)
      : history_path_(std::move(history_path)),
        complete_(std::move(complete)),
        history_(history_init(), history_end),
        editor_(el_init("locus", stdin, stdout, stderr), el_end) {
    LOCUS_CHECK(history_ != nullptr && editor_ != nullptr);
    std::setlocale(LC_CTYPE, "");  // the encoding of the terminal's characters
    if (MB_CUR_MAX == 1) std::setlocale(LC_CTYPE, "C.UTF-8");
    std::error_code ignored;  // without the folder no lines are kept
    if (!history_path_.empty())
      std::filesystem::create_directories(std::filesystem::path(history_path_).parent_path(), ignored);
    HistEvent event;
    history(history_.get(), &event, H_SETSIZE, kHistoryLines);
    history(history_.get(), &event, H_SETUNIQUE, 1);
    if (!history_path_.empty()) history(history_.get(), &event, H_LOAD, history_path_.c_str());
    EditLine* const editor = editor_.get();
    el_set(editor, EL_CLIENTDATA, this);
    el_set(
        editor, EL_PROMPT, +[](EditLine* line) { return self(line).prompt_.c_str(); });
    el_set(editor, EL_EDITOR, "emacs");
    el_set(editor, EL_HIST, history, history_.get());
    el_set(
        editor, EL_ADDFN, "locus-complete", "Complete the word",
        +[](EditLine* line, int) { return self(line).complete_word(); });
    el_set(
        editor, EL_ADDFN, "locus-drop", "Drop the line", +[](EditLine* line, int) { return self(line).drop(); });
    el_set(editor, EL_BIND, "^I", "locus-complete", nullptr);
    el_set(editor, EL_BIND, "^R", "em-inc-search-prev", nullptr);
    // While a line is edited, Ctrl-C is a character and no signal.
    el_set(editor, EL_SETTY, "-d", "-isig", nullptr);
    el_set(editor, EL_BIND, "^C", "locus-drop", nullptr);
  }

  LineEnd read(const std::string& prompt, std::string& line) override {
    prompt_ = prompt;
    dropped_ = false;
    int size = 0;
    // Before the prompt: el_gets() would do it after the prompt, and Ctrl-D or Ctrl-C typed in between would be lost.
    el_set(editor_.get(), EL_PREP_TERM, 1);
    const char* const text = el_gets(editor_.get(), &size);
    if (dropped_) return LineEnd::kDropped;
    if (text == nullptr || size <= 0) return LineEnd::kEnded;
    line.assign(text, static_cast<size_t>(size));
    if (!line.empty() && line.back() == '\n') line.pop_back();
    return LineEnd::kLine;
  }

  void remember(const std::string& input) override {
    if (input.empty()) return;
    HistEvent event;
    history(history_.get(), &event, H_ENTER, input.c_str());
    if (history_path_.empty()) return;
    const mode_t before = umask(0077);
    history(history_.get(), &event, H_SAVE, history_path_.c_str());
    umask(before);
  }

 private:
  static TerminalReader& self(EditLine* editor) {
    void* data = nullptr;
    el_get(editor, EL_CLIENTDATA, &data);
    return *static_cast<TerminalReader*>(data);
  }

  unsigned char complete_word() {
    const LineInfo* const line = el_line(editor_.get());
    const absl::string_view before(line->buffer, static_cast<size_t>(line->cursor - line->buffer));
    const std::vector<std::string> words = complete_(before);
    if (words.empty()) return CC_REFRESH_BEEP;
    const size_t blank = before.rfind(' ');
    const size_t typed = blank == absl::string_view::npos ? before.size() : before.size() - blank - 1;
    std::string added = common_prefix(words).substr(typed);
    if (words.size() == 1) added += ' ';
    if (!added.empty()) {
      el_insertstr(editor_.get(), added.c_str());
      return CC_REFRESH;
    }
    const size_t shown = std::min(words.size(), kMaxShown);
    const std::string list = absl::StrJoin(words.begin(), words.begin() + static_cast<std::ptrdiff_t>(shown), "  ");
    const std::string more = shown < words.size() ? absl::StrCat("  and ", words.size() - shown, " more") : "";
    std::fprintf(stdout, "\n%s%s\n", list.c_str(), more.c_str());
    return CC_REDISPLAY;
  }

  unsigned char drop() {
    dropped_ = true;
    std::fputs("^C\n", stdout);
    return CC_NEWLINE;
  }

  const std::string history_path_;
  const Complete complete_;
  std::string prompt_;
  bool dropped_ = false;
  std::unique_ptr<History, void (*)(History*)> history_;
  std::unique_ptr<EditLine, void (*)(EditLine*)> editor_;
};

class StreamReader final : public LineReader {
 public:
  explicit StreamReader(std::istream& in) : in_(in) {}
  LineEnd read(const std::string&, std::string& line) override {
    return std::getline(in_, line) ? LineEnd::kLine : LineEnd::kEnded;
  }
  void remember(const std::string&) override {}

 private:
  std::istream& in_;
};

}  // namespace

std::unique_ptr<LineReader> LineReader::of_terminal(std::string history_path, Complete complete) {
  return std::make_unique<TerminalReader>(std::move(history_path), std::move(complete));
}

std::unique_ptr<LineReader> LineReader::of_stream(std::istream& in) { return std::make_unique<StreamReader>(in); }

}  // namespace locus::cli
