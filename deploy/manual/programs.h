// The manual pages of the two installed programs. Only programs.cc includes the parsers of both programs; neither
// program includes code of the other.
#ifndef LOCUS_DEPLOY_MANUAL_PROGRAMS_H_
#define LOCUS_DEPLOY_MANUAL_PROGRAMS_H_

#include <vector>

#include "deploy/manual/manual_page.h"

namespace locus::manual {

// Returns locus(1) and a page for each of its commands.
std::vector<Page> pages_of_locus(Form form = Form::kRoff);

// Returns locusd(8) and a page for each of its commands.
std::vector<Page> pages_of_locusd(Form form = Form::kRoff);

}  // namespace locus::manual

#endif  // LOCUS_DEPLOY_MANUAL_PROGRAMS_H_
