// Fixed-length arrays of trivially copyable values. Arrays of at least kLargeArray bytes request pages of 2 MiB: with
// small pages, the traversal of a tree that is larger than the caches spends as much time on page table (TLB) misses as
// on cache misses. Measured at 4.3 million triangles: with large pages a ray takes a fifth to a third less time.
//
// Threads: as for a plain array, concurrent reads are safe and writes need exclusive access.
#ifndef LOCUS_CORE_BASE_LARGE_ARRAY_H_
#define LOCUS_CORE_BASE_LARGE_ARRAY_H_

#ifdef __linux__
#include <sys/mman.h>
#endif

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <new>
#include <type_traits>

#include "core/base/check.h"

namespace locus {

inline constexpr size_t kLargePage = size_t{1} << 21;
inline constexpr size_t kLargeArray = 4 * kLargePage;  // smallest array, in bytes, that uses large pages

// Deleter of a LargeArray; `alignment` is the alignment with which the array was allocated.
struct FreeLargeArray {
  std::align_val_t alignment{1};
  void operator()(void* memory) const { ::operator delete(memory, alignment); }
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
  const std::align_val_t alignment{bytes < kLargeArray ? std::max(alignof(T), alignof(std::max_align_t)) : kLargePage};
  void* const memory = ::operator new(bytes, alignment);
#ifdef MADV_HUGEPAGE
  // madvise() is only a hint: without large pages the array is correct but slower.
  if (bytes >= kLargeArray) madvise(memory, bytes / kLargePage * kLargePage, MADV_HUGEPAGE);
#endif
  return LargeArray<T>(static_cast<T*>(memory), FreeLargeArray{alignment});
}

}  // namespace locus

#endif  // LOCUS_CORE_BASE_LARGE_ARRAY_H_
