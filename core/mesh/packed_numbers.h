// Array of unsigned integers; each element occupies the number of bytes that the largest allowed value needs. Reads may
// run on any threads, but not concurrently with set().
#ifndef LOCUS_CORE_MESH_PACKED_NUMBERS_H_
#define LOCUS_CORE_MESH_PACKED_NUMBERS_H_

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/check.h"

namespace locus {

class PackedNumbers {
 public:
  PackedNumbers() = default;
  // Creates `count` elements of value 0, each of which can hold the values 0 to `largest`.
  PackedNumbers(size_t count, uint32_t largest)
      : width_((static_cast<size_t>(std::bit_width(largest)) + 7) / 8), bytes_(count * width_) {}

  // Sets an element. Precondition: `value` fits in the number of bytes that the constructor's `largest` needs.
  void set(size_t index, uint32_t value) {
    LOCUS_DCHECK_LE((index + 1) * width_, bytes_.size());
    LOCUS_DCHECK_LE(static_cast<size_t>(std::bit_width(value)), 8 * width_);
    for (size_t i = 0; i < width_; ++i) bytes_[index * width_ + i] = static_cast<uint8_t>(value >> (8 * i));
  }
  uint32_t operator[](size_t index) const {
    LOCUS_DCHECK_LE((index + 1) * width_, bytes_.size());
    uint32_t value = 0;
    for (size_t i = 0; i < width_; ++i) value |= uint32_t{bytes_[index * width_ + i]} << (8 * i);
    return value;
  }
  size_t bytes() const { return bytes_.capacity(); }

 private:
  size_t width_ = 0;  // number of bytes per element
  std::vector<uint8_t> bytes_;
};

}  // namespace locus

#endif  // LOCUS_CORE_MESH_PACKED_NUMBERS_H_
