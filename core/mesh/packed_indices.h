// An index list in few bytes, given back as it was: each index as its distance from the lowest that none was yet, one
// byte or two where neighbours in the list use neighbouring vertices. Immutable after creation; safe to share between
// threads, a reader is for one.
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

  // Gives the list from its start. The list must outlive it unmoved.
  class Reader {
   public:
    explicit Reader(const PackedIndices& packed) : next_(packed.bytes_.data()) {}

    // Not to be called more often than there are indices.
    uint32_t next();

   private:
    const uint8_t* next_;
    int64_t unused_ = 0;  // the lowest index that none was yet
  };

 private:
  std::vector<uint8_t> bytes_;
};

}  // namespace locus

#endif  // LOCUS_CORE_MESH_PACKED_INDICES_H_
