// Element that the builder sorts instead of the value itself: the value's box and index, with no more padding than
// vector instructions require. Plain data.
#ifndef LOCUS_CORE_INDEX_BOX_REFERENCE_H_
#define LOCUS_CORE_INDEX_BOX_REFERENCE_H_

#include <bit>
#include <cstdint>

#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/index/quad.h"

namespace locus {

// Box and index of a value; the index is stored in the spare lane of `min`. No default member initializers, so that
// allocating a large array writes no element: each element is first written by the thread that fills it.
template <class S>
struct BoxReference {
  Quad<S> min, max;

  // Makes a reference from a box and an index. The spare lanes of `box` may hold any value.
  static BoxReference of(const QuadBox<S>& box, uint32_t index);
  uint32_t index() const;
  QuadBox<S> box() const { return {min, max}; }
  // Returns twice the centre of the box. The factor has no effect, because the builder compares centres only with each
  // other.
  Quad<S> center() const { return min + max; }
};

template <class S>
using BoxReferences = absl::Span<BoxReference<S>>;

// Stores the index in the low 30 bits of a float of at least 2. The float is never denormal, because vector arithmetic,
// which includes the spare lane, is slow for denormal numbers.
template <>
inline BoxReference<float> BoxReference<float>::of(const QuadBox<float>& box, uint32_t index) {
  constexpr uint32_t kNormalBits = 0x40000000u;
  LOCUS_DCHECK_LT(index, kNormalBits);
  BoxReference reference = {box.min, box.max};
  reference.min.lanes[3] = std::bit_cast<float>(index | kNormalBits);
  return reference;
}
template <>
inline uint32_t BoxReference<float>::index() const {
  return std::bit_cast<uint32_t>(min[3]) & 0x3FFFFFFFu;
}
template <>
inline BoxReference<double> BoxReference<double>::of(const QuadBox<double>& box, uint32_t index) {
  BoxReference reference = {box.min, box.max};
  reference.min.lanes[3] = index;
  return reference;
}
template <>
inline uint32_t BoxReference<double>::index() const {
  return static_cast<uint32_t>(min[3]);
}
static_assert(limits::kMaxBvhValues <= 0x3FFFFFFFu);

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BOX_REFERENCE_H_
