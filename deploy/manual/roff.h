// A page of the manual in roff with the `man` macros, as man(7) describes them: a builder that escapes whatever it is
// given. For manual_page.h. Not thread-safe.
#ifndef LOCUS_DEPLOY_MANUAL_ROFF_H_
#define LOCUS_DEPLOY_MANUAL_ROFF_H_

#include <string>
#include <vector>

namespace locus::manual {

// `text` so that roff prints it as it is: nothing in it is a command, an escape, a hyphen where a minus is meant, or a
// curly quote. Ends of lines stay.
std::string escaped(const std::string& text);

// The same in bold or in italics.
std::string bold(const std::string& text);
std::string italic(const std::string& text);

class RoffPage {
 public:
  // All plain text.
  RoffPage(const std::string& title, const std::string& section, const std::string& source);

  RoffPage& heading(const std::string& name);
  // Running text; an empty line begins a new paragraph.
  RoffPage& text(const std::string& plain);
  // A term, which is markup of the functions above, and what there is to say of it.
  RoffPage& item(const std::string& markup, const std::string& plain);
  // One line of markup with its continuations indented.
  RoffPage& synopsis(const std::string& markup, const std::string& rest_markup);
  // Lines printed as they stand.
  RoffPage& literal(const std::vector<std::string>& lines);

  const std::string& roff() const { return roff_; }

 private:
  std::string roff_;
};

}  // namespace locus::manual

#endif  // LOCUS_DEPLOY_MANUAL_ROFF_H_
