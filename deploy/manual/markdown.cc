#include "deploy/manual/markdown.h"

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"

namespace locus::manual {

std::string markdown_escaped(const std::string& text) {
  constexpr absl::string_view kSpecial = "\\*_<>[]{}#|&!";
  std::string markdown;
  bool code = false;
  for (size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (c == '`') {
      code = !code && text.find('`', at + 1) != std::string::npos;
    } else if (!code && kSpecial.find(c) != absl::string_view::npos) {
      // An ampersand or an angle bracket is an entity, because a backslash does not escape it everywhere.
      absl::StrAppend(&markdown, c == '<'   ? "&lt;"
                                 : c == '>' ? "&gt;"
                                 : c == '&' ? "&amp;"
                                            : absl::StrCat("\\", std::string(1, c)));
      continue;
    }
    markdown.push_back(c);
  }
  return markdown;
}

MarkdownPage::MarkdownPage(const std::string& title) : markdown_(absl::StrCat("# ", markdown_escaped(title), "\n")) {}

std::string MarkdownPage::typed(const std::string& text) const { return absl::StrCat("`", text, "`"); }

std::string MarkdownPage::variable(const std::string& text) const {
  return text.empty() ? "" : absl::StrCat("*", markdown_escaped(text), "*");
}

std::string MarkdownPage::reference(const std::string& page, const std::string& section) const {
  return absl::StrCat("[", page, "(", section, ")](", page, ".md)");
}

MarkdownPage& MarkdownPage::heading(const std::string& name) {
  std::string words = absl::AsciiStrToLower(name);
  if (!words.empty()) words[0] = absl::ascii_toupper(static_cast<unsigned char>(words[0]));
  absl::StrAppend(&markdown_, "\n## ", words, "\n");
  return *this;
}

namespace {

// Returns the paragraphs of `plain` in Markdown, each of one or more lines that begin with `indent`.
std::string paragraphs(const std::string& plain, const std::string& indent) {
  std::string markdown;
  bool inside = false;
  for (const absl::string_view line : absl::StrSplit(plain, '\n')) {
    const std::string words(absl::StripAsciiWhitespace(line));
    if (!words.empty()) absl::StrAppend(&markdown, inside ? "" : "\n", indent, markdown_escaped(words), "\n");
    inside = !words.empty();
  }
  return markdown;
}

std::string fenced(const std::string& language, const std::vector<std::string>& lines) {
  return absl::StrCat("```", language, "\n", absl::StrJoin(lines, "\n"), "\n```\n");
}

}  // namespace

MarkdownPage& MarkdownPage::text(const std::string& plain) {
  absl::StrAppend(&markdown_, paragraphs(plain, ""));
  return *this;
}

MarkdownPage& MarkdownPage::item(const std::string& markup, const std::string& plain) {
  const std::string explanation = paragraphs(plain, "    ");
  // The first line of an explanation begins with a colon instead of a blank.
  const size_t first = explanation.find("    ");
  absl::StrAppend(&markdown_, "\n", markup, "\n");
  if (first != std::string::npos) absl::StrAppend(&markdown_, ":   ", explanation.substr(first + 4));
  return *this;
}

MarkdownPage& MarkdownPage::synopsis(const std::string& markup, const std::string& rest_markup) {
  absl::StrAppend(&markdown_, "\n", markup, rest_markup.empty() ? "" : " ", rest_markup, "\n");
  return *this;
}

MarkdownPage& MarkdownPage::references(const std::vector<std::string>& pages) {
  std::vector<std::string> links;
  for (const std::string& page : pages) {
    const size_t parenthesis = page.find('(');
    links.push_back(reference(page.substr(0, parenthesis), page.substr(parenthesis + 1, 1)));
  }
  absl::StrAppend(&markdown_, "\n", absl::StrJoin(links, ",\n"), "\n");
  return *this;
}

MarkdownPage& MarkdownPage::literal(const std::vector<std::string>& lines) {
  absl::StrAppend(&markdown_, "\n", fenced("text", lines));
  return *this;
}

namespace {

// Returns an example as a line for a shell: an explanation after it, which two blanks or more separate from it, becomes
// a comment.
std::string shell_line(const std::string& line) {
  const size_t begin = line.find_first_not_of(' ');
  const size_t gap = line.find("  ", begin);
  const size_t explanation = line.find_first_not_of(' ', gap);
  if (begin == std::string::npos || gap == std::string::npos || explanation == std::string::npos) return line;
  return absl::StrCat(line.substr(0, explanation), "# ", line.substr(explanation));
}

}  // namespace

MarkdownPage& MarkdownPage::examples(const std::vector<std::string>& lines) {
  std::vector<std::string> shell_lines;
  for (const std::string& line : lines) shell_lines.push_back(shell_line(line));
  absl::StrAppend(&markdown_,
                  "\n<!-- not run: The scenes and files of these examples do not exist; a test checks that the ",
                  "command lines are right. -->\n", fenced("sh", shell_lines));
  return *this;
}

}  // namespace locus::manual
