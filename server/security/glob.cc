#include "server/security/glob.h"

#include "core/base/planted_bug.h"

namespace locus::server {

bool glob_matches(absl::string_view pattern, absl::string_view text) {
  size_t p = 0, t = 0;
  size_t star = absl::string_view::npos, star_end = 0;  // last `*`, and the end of the text that it stands for so far
  while (t < text.size()) {
    if (p == pattern.size() && planted(PlantedBug::kGlobTooWide)) return true;
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      star_end = t;
    } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == text[t])) {
      ++p;
      ++t;
    } else if (star != absl::string_view::npos) {
      // Only the last `*` needs to grow: the pattern before it has already matched the shortest possible text.
      p = star + 1;
      t = ++star_end;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

bool is_glob(absl::string_view pattern) { return pattern.find_first_of("*?") != absl::string_view::npos; }

}  // namespace locus::server
