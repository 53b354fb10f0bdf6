// Patterns in which `*` stands for any number of characters and `?` for one character. Pure functions; any thread.
#ifndef LOCUS_SERVER_SECURITY_GLOB_H_
#define LOCUS_SERVER_SECURITY_GLOB_H_

#include "absl/strings/string_view.h"

namespace locus::server {

// Returns whether the whole text matches the pattern. Time: at most the product of both lengths, without recursion.
bool glob_matches(absl::string_view pattern, absl::string_view text);

// Returns whether the pattern contains `*` or `?`. Any other pattern matches only the text that equals the pattern.
bool is_glob(absl::string_view pattern);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_GLOB_H_
