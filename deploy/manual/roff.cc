#include "deploy/manual/roff.h"

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"

namespace locus::manual {

std::string escaped(const std::string& text) {
  std::string roff;
  bool line_begins = true;
  for (const char c : text) {
    // roff interprets a line that begins with one of these characters as a command.
    if (line_begins && (c == '.' || c == '\'')) absl::StrAppend(&roff, "\\&");
    switch (c) {
      case '\\':
        absl::StrAppend(&roff, "\\e");
        break;
      case '-':
        absl::StrAppend(&roff, "\\-");
        break;
      case '\'':
        absl::StrAppend(&roff, "\\(aq");
        break;
      case '`':
        absl::StrAppend(&roff, "\\(ga");
        break;
      case '"':
        absl::StrAppend(&roff, "\\(dq");
        break;
      case '^':
        absl::StrAppend(&roff, "\\(ha");
        break;
      case '~':
        absl::StrAppend(&roff, "\\(ti");
        break;
      default:
        roff.push_back(c);
    }
    line_begins = c == '\n';
  }
  return roff;
}

std::string bold(const std::string& text) { return absl::StrCat("\\fB", escaped(text), "\\fR"); }

std::string italic(const std::string& text) { return absl::StrCat("\\fI", escaped(text), "\\fR"); }

RoffPage::RoffPage(const std::string& title, const std::string& section, const std::string& source) {
  absl::StrAppend(&roff_, ".TH ", escaped(title), " ", section, R"( "" ")", escaped(source), "\"\n.nh\n.ad l\n");
}

std::string RoffPage::reference(const std::string& page, const std::string& section) const {
  return absl::StrCat(bold(page), "(", section, ")");
}

RoffPage& RoffPage::heading(const std::string& name) {
  absl::StrAppend(&roff_, ".SH ", escaped(name), "\n");
  return *this;
}

namespace {

// Returns `line` escaped for running text. Words of more than 30 characters may break after a comma, because
// hyphenation is off.
std::string running(const std::string& line) {
  constexpr size_t kLongWord = 30;
  std::vector<std::string> words = absl::StrSplit(escaped(line), ' ');
  for (std::string& word : words) {
    if (word.size() > kLongWord) word = absl::StrReplaceAll(word, {{",", ",\\:"}});
  }
  return absl::StrJoin(words, " ");
}

}  // namespace

RoffPage& RoffPage::text(const std::string& plain) {
  bool paragraph_ends = false;
  for (const absl::string_view line : absl::StrSplit(plain, '\n')) {
    const std::string words(absl::StripAsciiWhitespace(line));
    if (!words.empty()) absl::StrAppend(&roff_, paragraph_ends ? ".PP\n" : "", running(words), "\n");
    paragraph_ends = words.empty();
  }
  return *this;
}

RoffPage& RoffPage::item(const std::string& markup, const std::string& plain) {
  absl::StrAppend(&roff_, ".TP\n", markup, "\n");
  return text(plain);
}

RoffPage& RoffPage::synopsis(const std::string& markup, const std::string& rest_markup) {
  absl::StrAppend(&roff_, ".HP\n", markup, rest_markup.empty() ? "" : "\n", rest_markup, "\n");
  return *this;
}

RoffPage& RoffPage::name(const std::string& page, const std::string& summary) {
  return heading("NAME").text(absl::StrCat(page, " - ", summary));
}

RoffPage& RoffPage::references(const std::vector<std::string>& pages) { return text(absl::StrJoin(pages, ",\n")); }

RoffPage& RoffPage::literal(const std::vector<std::string>& lines) {
  absl::StrAppend(&roff_, ".RS 2\n.nf\n");
  for (const std::string& line : lines) absl::StrAppend(&roff_, escaped(line), "\n");
  absl::StrAppend(&roff_, ".fi\n.RE\n");
  return *this;
}

}  // namespace locus::manual
