// Reusable buffers: the writer of a scene keeps its buffers between batches, so that small batches allocate nothing. A
// buffer that grew above kKeptScratch bytes is freed, so that an idle scene does not retain the memory of its largest
// batch. Any thread.
#ifndef LOCUS_CORE_BASE_SCRATCH_H_
#define LOCUS_CORE_BASE_SCRATCH_H_

#include <cstddef>
#include <vector>

#include "core/base/check.h"

namespace locus {

inline constexpr size_t kKeptScratch = size_t{1} << 18;  // largest capacity, in bytes, that is not freed

// Clears `scratch`; frees its memory if its capacity is more than kKeptScratch bytes.
template <class T>
void clear_scratch(std::vector<T>& scratch) {
  scratch.clear();
  if (scratch.capacity() * sizeof(T) > kKeptScratch) std::vector<T>().swap(scratch);
  LOCUS_DCHECK(scratch.empty());
  LOCUS_DCHECK_LE(scratch.capacity() * sizeof(T), kKeptScratch);
}

}  // namespace locus

#endif  // LOCUS_CORE_BASE_SCRATCH_H_
