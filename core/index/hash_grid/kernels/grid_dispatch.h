// Selection of the hash grid's kernels by instruction set.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_KERNELS_GRID_DISPATCH_H_
#define LOCUS_CORE_INDEX_HASH_GRID_KERNELS_GRID_DISPATCH_H_

#include "core/index/hash_grid/kernels/grid_kernels.h"

namespace locus {

// Returns the AVX2 kernels if the active instruction set is kAvx2, otherwise the portable kernels. Thread-safe.
const GridKernels& active_grid_kernels();

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_HASH_GRID_KERNELS_GRID_DISPATCH_H_
