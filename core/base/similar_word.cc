#include "core/base/similar_word.h"

#include <algorithm>

#include "absl/strings/match.h"
#include "absl/strings/strip.h"

namespace locus {
namespace {

// Words are compared up to this length. Commands and options are shorter.
constexpr size_t kMaxCompared = 64;
// Almost every word is similar to a shorter one.
constexpr size_t kMinCompared = 2;

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

absl::string_view without_dashes(absl::string_view word) {
  while (absl::ConsumePrefix(&word, "-")) {
  }
  return word.substr(0, kMaxCompared);
}

bool abbreviates(absl::string_view word, absl::string_view candidate) {
  if (candidate.empty() || word.front() != candidate.front()) return false;
  size_t matched = 0;
  for (const char c : candidate)
    if (matched < word.size() && word[matched] == c) ++matched;
  return matched == word.size();
}

// Returns the first candidate for which `is_similar` returns true; an empty string if there is none.
template <class IsSimilar>
std::string first_of(const std::vector<std::string>& candidates, const IsSimilar& is_similar) {
  const auto found = std::find_if(candidates.begin(), candidates.end(),
                                  [&](const std::string& candidate) { return is_similar(without_dashes(candidate)); });
  return found == candidates.end() ? "" : *found;
}

}  // namespace

std::string similar_word(absl::string_view word, const std::vector<std::string>& candidates) {
  word = without_dashes(word);
  if (word.size() < kMinCompared) return "";
  const size_t max_edits = std::max<size_t>(1, word.size() / 3);
  const std::string* best = nullptr;
  size_t least = max_edits + 1;
  for (const std::string& candidate : candidates) {
    const absl::string_view compared = without_dashes(candidate);
    const size_t distance = compared.size() < kMinCompared ? least : edits(word, compared);
    if (distance >= least) continue;
    least = distance;
    best = &candidate;
  }
  if (best != nullptr) return *best;
  std::string begun =
      first_of(candidates, [&](absl::string_view candidate) { return absl::StartsWith(candidate, word); });
  if (!begun.empty()) return begun;
  std::string longer = first_of(candidates, [&](absl::string_view candidate) { return abbreviates(word, candidate); });
  if (!longer.empty()) return longer;
  constexpr size_t kMinBeginning = 3;
  return first_of(candidates, [&](absl::string_view candidate) {
    return candidate.size() >= kMinBeginning && absl::StartsWith(word, candidate);
  });
}

}  // namespace locus
