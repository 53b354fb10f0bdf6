// Arrays of plain data of a fixed length that may be very large. From a few MiB on they lie in pages of 2 MiB where the
// system gives them: a walk through a tree that outgrows the caches otherwise waits for page tables as long as for the
// tree itself (measured: a fifth to a third off a ray's time at 4.3 million triangles).
//
// Threads: as a plain array.
#ifndef LOCUS_CORE_BASE_LARGE_ARRAY_H_
#define LOCUS_CORE_BASE_LARGE_ARRAY_H_

#ifdef __linux__
#include <sys/mman.h>
#endif

#include <algorithm>
#include <cstddef>
#include <memory>
#include <new>
#include <type_traits>

namespace locus {

inline constexpr size_t kLargePage = size_t{1} << 21;
inline constexpr size_t kLargeArray = 4 * kLargePage;  // bytes from which on an array asks for large pages

struct FreeLargeArray {
  std::align_val_t alignment{1};
  void operator()(void* memory) const { ::operator delete(memory, alignment); }
};

template <class T>
using LargeArray = std::unique_ptr<T[], FreeLargeArray>;

// Not initialised. Whole large pages only: what is left at the end takes small ones, so that no memory is wasted.
template <class T>
LargeArray<T> make_large_array(size_t count) {
  static_assert(std::is_trivially_destructible_v<T> && std::is_trivially_copyable_v<T>);
  const size_t bytes = count * sizeof(T);
  const std::align_val_t alignment{bytes < kLargeArray ? std::max(alignof(T), alignof(std::max_align_t)) : kLargePage};
  void* const memory = ::operator new(bytes, alignment);
#ifdef MADV_HUGEPAGE
  // A wish: where it is not granted, the array is merely slower.
  if (bytes >= kLargeArray) madvise(memory, bytes / kLargePage * kLargePage, MADV_HUGEPAGE);
#endif
  return LargeArray<T>(static_cast<T*>(memory), FreeLargeArray{alignment});
}

}  // namespace locus

#endif  // LOCUS_CORE_BASE_LARGE_ARRAY_H_
