// Vectors that a writer keeps from batch to batch, so that small batches ask for no memory: what a large one made of
// them is given back, so that a scene at rest holds what it is and no more.
#ifndef LOCUS_CORE_BASE_SCRATCH_H_
#define LOCUS_CORE_BASE_SCRATCH_H_

#include <cstddef>
#include <vector>

namespace locus {

inline constexpr size_t kKeptScratch = size_t{1} << 18;  // bytes

// Empties it; its memory goes if it is more than kKeptScratch.
template <class T>
void clear_scratch(std::vector<T>& scratch) {
  scratch.clear();
  if (scratch.capacity() * sizeof(T) > kKeptScratch) std::vector<T>().swap(scratch);
}

}  // namespace locus

#endif  // LOCUS_CORE_BASE_SCRATCH_H_
