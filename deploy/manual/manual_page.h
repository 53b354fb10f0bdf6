// Manual pages from a parser's words: one for a program and one for each of its commands. What a parser does not know,
// exit statuses and variables, comes along as a Manual. For write_manual.cc.
#ifndef LOCUS_DEPLOY_MANUAL_MANUAL_PAGE_H_
#define LOCUS_DEPLOY_MANUAL_MANUAL_PAGE_H_

#include <string>
#include <utility>
#include <vector>

#include "client/cli/command_words.h"

namespace locus::manual {

// A word and what there is to say of it.
using Explained = std::vector<std::pair<std::string, std::string>>;

// What all pages of one program share.
struct Manual {
  std::string section;  // "1" for programs, "8" for daemons
  std::string version;
  Explained exit_statuses = {};
  Explained variables = {};
  std::vector<std::string> see_also = {};  // names of pages with their sections: "locusd(8)"
};

struct Page {
  std::string file;  // "locus-query-ray.1"
  std::string roff;
};

// The page of the program and of every command below it, the program's first.
std::vector<Page> manual_pages(const cli::CommandWords& program, const Manual& manual);

}  // namespace locus::manual

#endif  // LOCUS_DEPLOY_MANUAL_MANUAL_PAGE_H_
