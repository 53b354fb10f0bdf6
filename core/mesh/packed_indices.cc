#include "core/mesh/packed_indices.h"

#include <algorithm>
#include <limits>

#include "core/base/check.h"

namespace locus {
namespace {

// Bit of a byte that is set if another byte of the same variable-length integer follows. A byte stores seven bits of
// the integer, the lowest bits first.
constexpr uint64_t kMore = 0x80;

}  // namespace

PackedIndices::PackedIndices(absl::Span<const uint32_t> indices) {
  std::vector<uint8_t> bytes;
  bytes.reserve(2 * indices.size());
  int64_t next_unused = 0;
  for (const uint32_t index : indices) {
    const int64_t difference = next_unused - int64_t{index};
    // Zigzag encoding: the lowest bit is the sign.
    auto code = static_cast<uint64_t>(difference < 0 ? -2 * difference - 1 : 2 * difference);
    for (; code >= kMore; code >>= 7) bytes.push_back(static_cast<uint8_t>(code | kMore));
    bytes.push_back(static_cast<uint8_t>(code));
    next_unused = std::max(next_unused, int64_t{index} + 1);
  }
  bytes_.assign(bytes.begin(), bytes.end());
}

uint32_t PackedIndices::Reader::next() {
  uint64_t code = 0;
  for (int shift = 0;; shift += 7) {
    LOCUS_DCHECK(next_ < end_);
    const uint64_t byte = *next_++;
    code |= (byte & (kMore - 1)) << shift;
    if ((byte & kMore) == 0) break;
    LOCUS_DCHECK_LT(shift, 28);  // a code has at most 34 bits
  }
  const auto half = static_cast<int64_t>(code >> 1);
  const int64_t index = next_unused_ - ((code & 1) != 0 ? -half - 1 : half);
  LOCUS_DCHECK_GE(index, 0);
  LOCUS_DCHECK_LE(index, int64_t{std::numeric_limits<uint32_t>::max()});
  next_unused_ = std::max(next_unused_, index + 1);
  return static_cast<uint32_t>(index);
}

}  // namespace locus
