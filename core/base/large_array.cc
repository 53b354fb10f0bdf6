#include "core/base/large_array.h"

#ifdef __linux__
#include <sys/mman.h>

namespace locus::internal {

// For a large array, maps one large page more than needed, and unmaps what lies before the first border of a large page
// and after the end.
void* map_array(size_t bytes) {
  LOCUS_CHECK_LE(bytes, std::numeric_limits<size_t>::max() - 2 * kLargePage);
  const bool is_large = bytes >= kLargeArray;
  const size_t length = is_large ? bytes + kLargePage : bytes;
  void* const mapped = mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (mapped == MAP_FAILED) throw std::bad_alloc();
  mapped_array_bytes.fetch_add(bytes, std::memory_order_relaxed);
  if (!is_large) return mapped;
  char* const begin = static_cast<char*>(mapped);
  const size_t skipped = (kLargePage - reinterpret_cast<uintptr_t>(begin) % kLargePage) % kLargePage;
  if (skipped != 0) munmap(begin, skipped);
  constexpr size_t kSmallPage = 4096;  // pages may be larger; then the kernel refuses to unmap the end, which is unused
  const size_t used = (bytes + kSmallPage - 1) / kSmallPage * kSmallPage;
  if (skipped + used < length) munmap(begin + skipped + used, length - skipped - used);
#ifdef MADV_HUGEPAGE
  // madvise() is only a hint: without large pages the array is correct but slower.
  madvise(begin + skipped, bytes / kLargePage * kLargePage, MADV_HUGEPAGE);
#endif
  return begin + skipped;
}

void unmap_array(void* memory, size_t bytes) {
  munmap(memory, bytes);
  mapped_array_bytes.fetch_sub(bytes, std::memory_order_relaxed);
}

}  // namespace locus::internal
#endif
