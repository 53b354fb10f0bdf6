// The form that a manual page is written in: roff (roff.h) or Markdown (markdown.h). manual_page.cc calls these
// functions in the order of the page. Implementations escape all plain text; they are not thread-safe.
#ifndef LOCUS_DEPLOY_MANUAL_PAGE_FORM_H_
#define LOCUS_DEPLOY_MANUAL_PAGE_FORM_H_

#include <string>
#include <vector>

namespace locus::manual {

// The forms: manual pages for man(1), and pages of the site.
enum class Form { kRoff, kMarkdown };

class PageForm {
 public:
  virtual ~PageForm() = default;

  // Return markup of a word that is typed as it stands, of a word that stands for another, and of a reference to the
  // page of another command, such as "locus-query" in section "1".
  virtual std::string typed(const std::string& text) const = 0;
  virtual std::string variable(const std::string& text) const = 0;
  virtual std::string reference(const std::string& page, const std::string& section) const = 0;

  // Begins the page after its title: the name of the page and a summary of one line.
  virtual PageForm& name(const std::string& page, const std::string& summary) = 0;
  virtual PageForm& heading(const std::string& name) = 0;
  // Adds running text; an empty line begins a new paragraph.
  virtual PageForm& text(const std::string& plain) = 0;
  // Adds a term and its explanation. `markup` is the term, made by the functions above; `plain` is plain text.
  virtual PageForm& item(const std::string& markup, const std::string& plain) = 0;
  // Adds a synopsis: `markup`, followed by `rest_markup`.
  virtual PageForm& synopsis(const std::string& markup, const std::string& rest_markup) = 0;
  // Adds references to other pages, each a name with its section, such as "locusd(8)".
  virtual PageForm& references(const std::vector<std::string>& pages) = 0;
  // Adds lines that are printed unchanged.
  virtual PageForm& literal(const std::vector<std::string>& lines) = 0;
  // Adds examples: command lines.
  virtual PageForm& examples(const std::vector<std::string>& lines) = 0;

  // Returns the page as written so far.
  virtual const std::string& written() const = 0;
};

}  // namespace locus::manual

#endif  // LOCUS_DEPLOY_MANUAL_PAGE_FORM_H_
