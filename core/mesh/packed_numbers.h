// An array of whole numbers in as many bytes each as the largest needs. Safe to read from any threads once filled.
#ifndef LOCUS_CORE_MESH_PACKED_NUMBERS_H_
#define LOCUS_CORE_MESH_PACKED_NUMBERS_H_

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace locus {

class PackedNumbers {
 public:
  PackedNumbers() = default;
  // `count` zeros, each with room for 0 .. `largest`.
  PackedNumbers(size_t count, uint32_t largest)
      : width_((static_cast<size_t>(std::bit_width(largest)) + 7) / 8), bytes_(count * width_) {}

  void set(size_t place, uint32_t number) {
    for (size_t i = 0; i < width_; ++i) bytes_[place * width_ + i] = static_cast<uint8_t>(number >> (8 * i));
  }
  uint32_t operator[](size_t place) const {
    uint32_t number = 0;
    for (size_t i = 0; i < width_; ++i) number |= uint32_t{bytes_[place * width_ + i]} << (8 * i);
    return number;
  }
  size_t bytes() const { return bytes_.capacity(); }

 private:
  size_t width_ = 0;
  std::vector<uint8_t> bytes_;
};

}  // namespace locus

#endif  // LOCUS_CORE_MESH_PACKED_NUMBERS_H_
