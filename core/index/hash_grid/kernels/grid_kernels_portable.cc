// Hash grid kernels for any processor: the compiler splits each vector of eight floats into two halves, or into single
// floats.
#include "core/index/hash_grid/kernels/grid_kernels_impl.h"

namespace locus {

const GridKernels& grid_kernels_portable() {
  static constexpr GridKernels kKernels = kernels_named("portable");
  return kKernels;
}

}  // namespace locus
