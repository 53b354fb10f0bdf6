// Hash grid kernels compiled for AVX2.
#include "core/index/hash_grid/kernels/grid_kernels_impl.h"

namespace locus {

const GridKernels& grid_kernels_avx2() {
  static constexpr GridKernels kKernels = kernels_named("avx2");
  return kKernels;
}

}  // namespace locus
