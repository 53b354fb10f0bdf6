// Generator of manual pages from the help texts of a command-line parser: one page for a program and one for each of
// its commands. The parser does not contain exit statuses and environment variables, so they are passed as a Manual.
// Used by write_manual.cc.
#ifndef LOCUS_DEPLOY_MANUAL_MANUAL_PAGE_H_
#define LOCUS_DEPLOY_MANUAL_MANUAL_PAGE_H_

#include <string>
#include <utility>
#include <vector>

#include "client/cli/command_words.h"
#include "deploy/manual/page_form.h"

namespace locus::manual {

// List of pairs: a term and its explanation.
using Explained = std::vector<std::pair<std::string, std::string>>;

// Properties that all pages of a program share.
struct Manual {
  std::string section;  // "1" for programs, "8" for daemons
  std::string version;
  Explained exit_statuses = {};
  Explained variables = {};
  std::vector<std::string> see_also = {};  // other pages with their sections, such as "locusd(8)"
};

struct Page {
  std::string file;  // "locus-query-ray.1", or "locus-query-ray.md" for the site
  std::string text;
};

// Returns the page of the program, followed by the pages of every command below it.
std::vector<Page> manual_pages(const cli::CommandWords& program, const Manual& manual, Form form = Form::kRoff);

}  // namespace locus::manual

#endif  // LOCUS_DEPLOY_MANUAL_MANUAL_PAGE_H_
