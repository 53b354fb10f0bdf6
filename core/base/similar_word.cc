#include "core/base/similar_word.h"

#include <algorithm>

namespace locus {
namespace {

// Words are compared up to this length. Commands and options are shorter.
constexpr size_t kMaxCompared = 64;

// Returns the number of edits that turn `a` into `b`. A swap counts only if neither character is edited again.
size_t edits(absl::string_view a, absl::string_view b) {
  // Row i has the numbers of edits that turn the first i characters of `a` into each beginning of `b`.
  std::vector<size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (size_t i = 1; i <= a.size(); ++i) {
    before.swap(last);
    last.swap(row);
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row[b.size()];
}

// Returns the longest candidate with which `word` begins, of at least 3 characters; an empty string if there is none.
std::string longest_beginning(absl::string_view word, const std::vector<std::string>& candidates) {
  constexpr size_t kMinBeginning = 3;
  std::string longest;
  for (const std::string& candidate : candidates) {
    const bool begins = candidate.size() >= kMinBeginning && word.substr(0, candidate.size()) == candidate;
    if (begins && candidate.size() > longest.size()) longest = candidate;
  }
  return longest;
}

bool abbreviates(absl::string_view word, absl::string_view candidate) {
  if (word.size() < 2 || candidate.empty() || word.front() != candidate.front()) return false;
  size_t matched = 0;
  for (const char c : candidate)
    if (matched < word.size() && word[matched] == c) ++matched;
  return matched == word.size();
}

}  // namespace

std::string similar_word(absl::string_view word, const std::vector<std::string>& candidates) {
  word = word.substr(0, kMaxCompared);
  const size_t max_edits = std::max<size_t>(1, word.size() / 3);
  const std::string* best = nullptr;
  size_t least = max_edits + 1;
  for (const std::string& candidate : candidates) {
    const size_t distance = edits(word, absl::string_view(candidate).substr(0, kMaxCompared));
    if (distance >= least) continue;
    least = distance;
    best = &candidate;
  }
  if (best != nullptr) return *best;
  for (const std::string& candidate : candidates)
    if (abbreviates(word, candidate)) return candidate;
  return longest_beginning(word, candidates);
}

}  // namespace locus
