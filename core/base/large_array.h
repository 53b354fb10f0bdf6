// Fixed-length arrays of trivially copyable values. Arrays of at least kMappedArray bytes are mappings of their own, so
// that their memory returns to the system when they are freed. Arrays of at least kLargeArray bytes request pages of 2
// MiB: with
// small pages, the traversal of a tree that is larger than the caches spends as much time on page table (TLB) misses as
// on cache misses. Measured at 4.3 million triangles: with large pages a ray takes a fifth to a third less time.
//
// Threads: as for a plain array, concurrent reads are safe and writes need exclusive access.
#ifndef LOCUS_CORE_BASE_LARGE_ARRAY_H_
#define LOCUS_CORE_BASE_LARGE_ARRAY_H_

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <new>
#include <type_traits>

#include "core/base/check.h"

namespace locus {

inline constexpr size_t kLargePage = size_t{1} << 21;
inline constexpr size_t kMappedArray = kLargePage / 2;  // smallest array, in bytes, that is a mapping of its own
inline constexpr size_t kLargeArray = 4 * kLargePage;   // smallest array, in bytes, that uses large pages

namespace internal {
inline std::atomic<uint64_t> mapped_array_bytes{0};
// Returns a new mapping of `bytes` bytes, which is aligned to kLargePage if `bytes` is at least kLargeArray. Throws
// std::bad_alloc if there is no memory.
void* map_array(size_t bytes);
void unmap_array(void* memory, size_t bytes);
}  // namespace internal

// Returns the bytes of all arrays that are mappings of their own.
inline uint64_t mapped_array_bytes() { return internal::mapped_array_bytes.load(std::memory_order_relaxed); }

// Deleter of a LargeArray: `mapped_bytes` is the size of its mapping, or 0 if the array was allocated by operator new
// with `alignment`.
struct FreeLargeArray {
  std::align_val_t alignment{1};
  size_t mapped_bytes = 0;
  void operator()(void* memory) const {
    if (mapped_bytes != 0) return internal::unmap_array(memory, mapped_bytes);
    ::operator delete(memory, alignment);
  }
};

template <class T>
using LargeArray = std::unique_ptr<T[], FreeLargeArray>;

// Returns an array of `count` uninitialised values. For a large array, requests as many large pages as the array fills
// completely; the remainder at its end uses small pages, so that no memory is wasted.
template <class T>
LargeArray<T> make_large_array(size_t count) {
  static_assert(std::is_trivially_destructible_v<T> && std::is_trivially_copyable_v<T>);
  LOCUS_DCHECK_LE(count, std::numeric_limits<size_t>::max() / sizeof(T));
  const size_t bytes = count * sizeof(T);
#ifdef __linux__
  if (bytes >= kMappedArray)
    return LargeArray<T>(static_cast<T*>(internal::map_array(bytes)), FreeLargeArray{{}, bytes});
#endif
  const std::align_val_t alignment{std::max(alignof(T), alignof(std::max_align_t))};
  return LargeArray<T>(static_cast<T*>(::operator new(bytes, alignment)), FreeLargeArray{alignment});
}

}  // namespace locus

#endif  // LOCUS_CORE_BASE_LARGE_ARRAY_H_
