#include "core/mesh/packed_indices.h"

#include <algorithm>

namespace locus {
namespace {

// Seven bits a byte, the lowest first; the eighth says that more follow.
constexpr uint64_t kMore = 0x80;

}  // namespace

PackedIndices::PackedIndices(absl::Span<const uint32_t> indices) {
  std::vector<uint8_t> bytes;
  bytes.reserve(2 * indices.size());
  int64_t unused = 0;
  for (const uint32_t index : indices) {
    const int64_t back = unused - int64_t{index};
    // The sign goes into the lowest bit.
    auto code = static_cast<uint64_t>(back < 0 ? -2 * back - 1 : 2 * back);
    for (; code >= kMore; code >>= 7) bytes.push_back(static_cast<uint8_t>(code | kMore));
    bytes.push_back(static_cast<uint8_t>(code));
    unused = std::max(unused, int64_t{index} + 1);
  }
  bytes_.assign(bytes.begin(), bytes.end());
}

uint32_t PackedIndices::Reader::next() {
  uint64_t code = 0;
  for (int shift = 0;; shift += 7) {
    const uint64_t byte = *next_++;
    code |= (byte & (kMore - 1)) << shift;
    if ((byte & kMore) == 0) break;
  }
  const auto half = static_cast<int64_t>(code >> 1);
  const int64_t index = unused_ - ((code & 1) != 0 ? -half - 1 : half);
  unused_ = std::max(unused_, index + 1);
  return static_cast<uint32_t>(index);
}

}  // namespace locus
