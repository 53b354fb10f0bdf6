// Patterns in which `*` stands for any run of characters and `?` for one. Pure functions; any thread.
#ifndef LOCUS_SERVER_SECURITY_GLOB_H_
#define LOCUS_SERVER_SECURITY_GLOB_H_

#include "absl/strings/string_view.h"

namespace locus::server {

// Returns whether the whole text matches the pattern. Time: at most the product of both lengths, without recursion.
bool glob_matches(absl::string_view pattern, absl::string_view text);

// Returns whether the pattern contains `*` or `?`. A pattern without them matches only a text equal to it.
bool is_glob(absl::string_view pattern);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_GLOB_H_
