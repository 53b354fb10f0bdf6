// Builder of a manual page in roff with the `man` macros (man(7)). The builder escapes all plain text. Used by
// manual_page.cc. Not thread-safe.
#ifndef LOCUS_DEPLOY_MANUAL_ROFF_H_
#define LOCUS_DEPLOY_MANUAL_ROFF_H_

#include <string>
#include <vector>

namespace locus::manual {

// Returns `text` escaped, so that roff prints it unchanged: no part of it is interpreted as a command or an escape
// sequence, and minus signs and straight quotes are kept. Line ends are kept.
std::string escaped(const std::string& text);

// Return the escaped text in bold or in italics.
std::string bold(const std::string& text);
std::string italic(const std::string& text);

class RoffPage {
 public:
  // Begins the page. The arguments are plain text.
  RoffPage(const std::string& title, const std::string& section, const std::string& source);

  RoffPage& heading(const std::string& name);
  // Adds running text; an empty line begins a new paragraph.
  RoffPage& text(const std::string& plain);
  // Adds a term and its explanation. `markup` is the term as roff, made by escaped(), bold() or italic(); `plain` is
  // the explanation as plain text.
  RoffPage& item(const std::string& markup, const std::string& plain);
  // Adds a synopsis: `markup`, followed by `rest_markup`. Lines after the first are indented.
  RoffPage& synopsis(const std::string& markup, const std::string& rest_markup);
  // Adds lines that are printed unchanged.
  RoffPage& literal(const std::vector<std::string>& lines);

  const std::string& roff() const { return roff_; }

 private:
  std::string roff_;
};

}  // namespace locus::manual

#endif  // LOCUS_DEPLOY_MANUAL_ROFF_H_
