#include "core/query/kinds/found_objects.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include "core/base/scratch.h"

namespace locus {
namespace {

bool lower_id(const FoundObject& a, const FoundObject& b) { return a.id < b.id; }

// For few, or for what is almost in order.
void sort_by_moving(std::vector<FoundObject>& found) {
  for (size_t i = 1; i < found.size(); ++i) {
    if (!lower_id(found[i], found[i - 1])) continue;
    const FoundObject moved = found[i];
    size_t to = i;
    for (; to > 0 && lower_id(moved, found[to - 1]); --to) found[to] = found[to - 1];
    found[to] = moved;
  }
}

constexpr size_t kFew = 12;
// Of so many one share of the ids holds a few at most, unless they are uneven.
constexpr size_t kMaxSpread = 1024;
constexpr int kShareBits = 8;
constexpr uint32_t kMaxOfAShare = 16;

}  // namespace

void FoundObjects::restart(size_t most) {
  most_ = most;
  truncated_ = false;
  clear_scratch(found_);
}

absl::Span<const FoundObject> FoundObjects::finish() {
  keep_lowest();
  sort();
  return found_;
}

void FoundObjects::keep_lowest() {
  if (found_.size() <= most_) return;
  truncated_ = true;
  std::nth_element(found_.begin(), found_.begin() + static_cast<std::ptrdiff_t>(most_), found_.end(), lower_id);
  found_.resize(most_);
}

// Comparing ids in no order costs a mispredicted branch every other time: shares of the ids are as good as sorted
// without.
void FoundObjects::sort() {
  if (found_.size() <= kFew || (found_.size() <= kMaxSpread && spread())) return sort_by_moving(found_);
  std::sort(found_.begin(), found_.end(), lower_id);
}

bool FoundObjects::spread() {
  Id lowest = std::numeric_limits<Id>::max(), highest = 0;
  for (const FoundObject& one : found_) {
    lowest = std::min(lowest, one.id);
    highest = std::max(highest, one.id);
  }
  const int shift = std::max(static_cast<int>(std::bit_width(highest - lowest)) - kShareBits, 0);
  std::array<uint32_t, size_t{1} << kShareBits> shares{};
  for (const FoundObject& one : found_) ++shares[(one.id - lowest) >> shift];
  uint32_t before = 0, largest = 0;
  for (uint32_t& share : shares) {
    largest = std::max(largest, share);
    const uint32_t count = share;
    share = before;
    before += count;
  }
  if (largest > kMaxOfAShare) return false;
  spread_.resize(std::max(spread_.size(), found_.size()));
  for (const FoundObject& one : found_) spread_[shares[(one.id - lowest) >> shift]++] = one;
  std::copy_n(spread_.begin(), found_.size(), found_.begin());
  return true;
}

}  // namespace locus
