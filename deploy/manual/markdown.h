// Builder of a page of the site in Markdown, with definition lists. The builder escapes all plain text. Used by
// manual_page.cc. Not thread-safe.
#ifndef LOCUS_DEPLOY_MANUAL_MARKDOWN_H_
#define LOCUS_DEPLOY_MANUAL_MARKDOWN_H_

#include <string>
#include <vector>

#include "deploy/manual/page_form.h"

namespace locus::manual {

// Returns `text` escaped, so that Markdown prints it unchanged, except that words between backticks are set as code.
std::string markdown_escaped(const std::string& text);

class MarkdownPage : public PageForm {
 public:
  // Begins the page with its title, which is plain text.
  explicit MarkdownPage(const std::string& title);

  // Sets the word as code.
  std::string typed(const std::string& text) const override;
  std::string variable(const std::string& text) const override;
  // Returns a link to the file of the page, which lies in the same folder.
  std::string reference(const std::string& page, const std::string& section) const override;

  // Adds nothing: the title names the page, and the description begins with the summary.
  MarkdownPage& name(const std::string&, const std::string&) override { return *this; }
  // Adds a heading. `name` is in capitals, as in roff; only the first letter stays one.
  MarkdownPage& heading(const std::string& name) override;
  MarkdownPage& text(const std::string& plain) override;
  MarkdownPage& item(const std::string& markup, const std::string& plain) override;
  MarkdownPage& synopsis(const std::string& markup, const std::string& rest_markup) override;
  MarkdownPage& references(const std::vector<std::string>& pages) override;
  MarkdownPage& literal(const std::vector<std::string>& lines) override;
  // Adds command lines with a mark that says why the tests of the site do not run them.
  MarkdownPage& examples(const std::vector<std::string>& lines) override;

  const std::string& written() const override { return markdown_; }

 private:
  std::string markdown_;
};

}  // namespace locus::manual

#endif  // LOCUS_DEPLOY_MANUAL_MARKDOWN_H_
