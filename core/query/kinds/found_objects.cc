#include "core/query/kinds/found_objects.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "absl/container/inlined_vector.h"
#include "core/base/scratch.h"

namespace locus {
namespace {

bool lower_id(const FoundObject& a, const FoundObject& b) { return a.id < b.id; }

// Sorts `found` by id with an insertion sort, which is fast for few objects and for almost sorted objects.
void insertion_sort(std::vector<FoundObject>& found) {
  for (size_t i = 1; i < found.size(); ++i) {
    if (!lower_id(found[i], found[i - 1])) continue;
    const FoundObject moved = found[i];
    size_t to = i;
    for (; to > 0 && lower_id(moved, found[to - 1]); --to) found[to] = found[to - 1];
    found[to] = moved;
  }
}

// Maximum number of objects that are sorted by insertion without buckets.
constexpr size_t kFew = 12;
// Minimum of the binary logarithm of the number of buckets. If there are more buckets than this minimum, the number of
// objects is at least two and less than four times the number of buckets. Evenly distributed ids then fill each bucket
// with two to four objects.
constexpr int kMinBucketBits = 8;
// Maximum number of objects in one bucket. More objects in a bucket show that the ids are unevenly distributed;
// std::sort() is then used instead of the buckets.
constexpr uint32_t kMaxPerBucket = 16;

}  // namespace

void FoundObjects::restart(size_t max_count, CountOnly count_only) {
  max_count_ = max_count;
  count_only_ = count_only;
  count_ = 0;
  truncated_ = false;
  clear_scratch(found_);
  LOCUS_DCHECK_CALL(check_invariants());
}

absl::Span<const FoundObject> FoundObjects::finish() {
  keep_lowest();
  sort();
  if constexpr (kDebugChecks) {
    LOCUS_DCHECK_LE(found_.size(), max_count_);
    for (size_t i = 1; i < found_.size(); ++i) LOCUS_DCHECK_LT(found_[i - 1].id, found_[i].id);
  }
  return found_;
}

void FoundObjects::keep_lowest() {
  if (found_.size() <= max_count_) return;
  truncated_ = true;
  std::nth_element(found_.begin(), found_.begin() + static_cast<std::ptrdiff_t>(max_count_), found_.end(), lower_id);
  found_.resize(max_count_);
  LOCUS_DCHECK_CALL(check_invariants());
}

// Sorts found_ by id, with sort_by_bucket() if possible. Distributing objects to buckets needs no comparisons of ids.
// If the ids are in random order, the branches of such comparisons would be mispredicted half of the time. The
// distribution leaves the objects almost sorted, so that insertion_sort() is fast.
void FoundObjects::sort() {
  if (found_.size() <= kFew || sort_by_bucket()) return insertion_sort(found_);
  std::sort(found_.begin(), found_.end(), lower_id);
}

bool FoundObjects::sort_by_bucket() {
  Id lowest = std::numeric_limits<Id>::max(), highest = 0;
  for (const FoundObject& object : found_) {
    lowest = std::min(lowest, object.id);
    highest = std::max(highest, object.id);
  }
  const int bits = std::max(static_cast<int>(std::bit_width(found_.size())) - 2, kMinBucketBits);
  const int shift = std::max(static_cast<int>(std::bit_width(highest - lowest)) - bits, 0);
  absl::InlinedVector<uint32_t, size_t{1} << kMinBucketBits> buckets(size_t{1} << bits);
  for (const FoundObject& object : found_) ++buckets[(object.id - lowest) >> shift];
  uint32_t before = 0, largest = 0;
  for (uint32_t& bucket : buckets) {
    largest = std::max(largest, bucket);
    const uint32_t count = bucket;
    bucket = before;
    before += count;
  }
  LOCUS_DCHECK_EQ(before, found_.size());
  if (largest > kMaxPerBucket) return false;
  bucketed_.resize(std::max(bucketed_.size(), found_.size()));
  for (const FoundObject& object : found_) bucketed_[buckets[(object.id - lowest) >> shift]++] = object;
  std::copy_n(bucketed_.begin(), found_.size(), found_.begin());
  return true;
}

}  // namespace locus
