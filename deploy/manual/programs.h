// The pages of the two programs that are installed. The only place that sees the parsers of both: neither program
// includes anything of the other.
#ifndef LOCUS_DEPLOY_MANUAL_PROGRAMS_H_
#define LOCUS_DEPLOY_MANUAL_PROGRAMS_H_

#include <vector>

#include "deploy/manual/manual_page.h"

namespace locus::manual {

// locus(1) and a page for each command.
std::vector<Page> pages_of_locus();

// locusd(8).
std::vector<Page> pages_of_locusd();

}  // namespace locus::manual

#endif  // LOCUS_DEPLOY_MANUAL_PROGRAMS_H_
