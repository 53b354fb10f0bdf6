// Builder of a manual page in roff with the `man` macros (man(7)). The builder escapes all plain text. Used by
// manual_page.cc. Not thread-safe.
#ifndef LOCUS_DEPLOY_MANUAL_ROFF_H_
#define LOCUS_DEPLOY_MANUAL_ROFF_H_

#include <string>
#include <vector>

#include "deploy/manual/page_form.h"

namespace locus::manual {

// Returns `text` escaped, so that roff prints it unchanged: no part of it is interpreted as a command or an escape
// sequence, and minus signs and straight quotes are kept. Line ends are kept.
std::string escaped(const std::string& text);

// Return the escaped text in bold or in italics.
std::string bold(const std::string& text);
std::string italic(const std::string& text);

class RoffPage : public PageForm {
 public:
  // Begins the page. The arguments are plain text.
  RoffPage(const std::string& title, const std::string& section, const std::string& source);

  std::string typed(const std::string& text) const override { return bold(text); }
  std::string variable(const std::string& text) const override { return italic(text); }
  std::string reference(const std::string& page, const std::string& section) const override;

  RoffPage& name(const std::string& page, const std::string& summary) override;
  RoffPage& heading(const std::string& name) override;
  RoffPage& text(const std::string& plain) override;
  RoffPage& item(const std::string& markup, const std::string& plain) override;
  // Adds a synopsis. Lines after the first are indented.
  RoffPage& synopsis(const std::string& markup, const std::string& rest_markup) override;
  RoffPage& references(const std::vector<std::string>& pages) override;
  RoffPage& literal(const std::vector<std::string>& lines) override;
  RoffPage& examples(const std::vector<std::string>& lines) override { return literal(lines); }

  const std::string& written() const override { return roff_; }
  const std::string& roff() const { return roff_; }

 private:
  std::string roff_;
};

}  // namespace locus::manual

#endif  // LOCUS_DEPLOY_MANUAL_ROFF_H_
