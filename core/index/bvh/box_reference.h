// What the builder sorts instead of values: a box and an index, as narrow as vector instructions allow. Plain data.
#ifndef LOCUS_CORE_INDEX_BVH_BOX_REFERENCE_H_
#define LOCUS_CORE_INDEX_BVH_BOX_REFERENCE_H_

#include <bit>
#include <cstdint>

#include "absl/types/span.h"
#include "core/base/limits.h"
#include "core/index/bvh/quad.h"

namespace locus {

// A value's box and its index, which lies in the spare lane of `min`. Without defaults: large arrays of it are filled
// by many threads.
template <class S>
struct BoxReference {
  Quad<S> min, max;

  // The box's spare lanes may hold anything.
  static BoxReference of(const QuadBox<S>& box, uint32_t index);
  uint32_t index() const;
  QuadBox<S> box() const { return {min, max}; }
  // Twice the centre: only compared with its like.
  Quad<S> center() const { return min + max; }
};

template <class S>
using BoxReferences = absl::Span<BoxReference<S>>;

// A whole number as the bits of an ordinary float, whose sums and products cost nothing.
template <>
inline BoxReference<float> BoxReference<float>::of(const QuadBox<float>& box, uint32_t index) {
  constexpr uint32_t kOrdinary = 0x40000000u;
  BoxReference reference = {box.min, box.max};
  reference.min.lanes[3] = std::bit_cast<float>(index | kOrdinary);
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

#endif  // LOCUS_CORE_INDEX_BVH_BOX_REFERENCE_H_
