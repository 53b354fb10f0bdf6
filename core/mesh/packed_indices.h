// Lossless compressed list of vertex indices. Each index is stored as its difference from the next unused index, which
// is one more than the largest index before it in the list. Most differences take one or two bytes if triangles that
// are close in the list use vertices that are close in the vertex array. Immutable after creation; any thread. A Reader
// belongs to one thread.
#ifndef LOCUS_CORE_MESH_PACKED_INDICES_H_
#define LOCUS_CORE_MESH_PACKED_INDICES_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/types/span.h"

namespace locus {

class PackedIndices {
 public:
  PackedIndices() = default;
  explicit PackedIndices(absl::Span<const uint32_t> indices);

  size_t bytes() const { return bytes_.capacity(); }

  // Sequential reader of the list, from its start. The PackedIndices object must outlive the reader and must not be
  // moved.
  class Reader {
   public:
    explicit Reader(const PackedIndices& packed) : next_(packed.bytes_.data()), end_(next_ + packed.bytes_.size()) {}

    // Returns the next index. Precondition: the list has an index that next() has not returned yet.
    uint32_t next();

   private:
    const uint8_t* next_;
    const uint8_t* end_;
    int64_t next_unused_ = 0;  // one more than the largest index so far
  };

 private:
  std::vector<uint8_t> bytes_;
};

}  // namespace locus

#endif  // LOCUS_CORE_MESH_PACKED_INDICES_H_
