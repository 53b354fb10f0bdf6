// Suggestion for a mistyped word, for errors such as "did you mean `query`?". Function without state; any thread.
#ifndef LOCUS_CORE_BASE_SIMILAR_WORD_H_
#define LOCUS_CORE_BASE_SIMILAR_WORD_H_

#include <string>
#include <vector>

#include "absl/strings/string_view.h"

namespace locus {

// Returns the candidate that is most similar to `word`; the first one if several are equally similar, and an empty
// string if none is similar. Dashes at the beginning of words do not count. Edits come first: a candidate is similar if
// a few edits turn `word` into it, one for each three characters of the word, at least one. An edit inserts, removes or
// replaces a character, or swaps two adjacent ones. If no candidate is that near, one is similar that begins with
// `word`; then one that `word` abbreviates (it begins with the same character and has the other characters of `word` in
// their order, as `list` for `ls`); then one with which `word` begins, as `--dir` for `--direction`.
// Cost: O(candidates * word * candidate).
// Source: Damerau, A Technique for Computer Detection and Correction of Spelling Errors, 1964, for the edits.
std::string similar_word(absl::string_view word, const std::vector<std::string>& candidates);

}  // namespace locus

#endif  // LOCUS_CORE_BASE_SIMILAR_WORD_H_
