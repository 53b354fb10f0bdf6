// Builder of a manual page in roff with the `man` macros, as man(7) describes them. It escapes all text. For
// manual_page.h. Not thread-safe.
#ifndef LOCUS_DEPLOY_MANUAL_ROFF_H_
#define LOCUS_DEPLOY_MANUAL_ROFF_H_

#include <string>
#include <vector>

namespace locus::manual {

// Returns `text` escaped, so that roff prints it unchanged: without commands, escapes, hyphens instead of minus signs
// or curly quotes. Ends of lines are kept.
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
  // Adds a term, in markup of the functions above, and its explanation.
  RoffPage& item(const std::string& markup, const std::string& plain);
  // Adds one line of markup whose continuation lines are indented.
  RoffPage& synopsis(const std::string& markup, const std::string& rest_markup);
  // Adds lines that are printed unchanged.
  RoffPage& literal(const std::vector<std::string>& lines);

  const std::string& roff() const { return roff_; }

 private:
  std::string roff_;
};

}  // namespace locus::manual

#endif  // LOCUS_DEPLOY_MANUAL_ROFF_H_
