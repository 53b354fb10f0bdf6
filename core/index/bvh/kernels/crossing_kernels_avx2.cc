// Crossing kernels compiled for AVX2 and FMA.
#include "core/index/bvh/kernels/crossing_kernels_impl.h"

namespace locus {

const CrossingKernels& crossing_kernels_avx2() {
  static constexpr CrossingKernels kKernels = {"avx2", sum_crossings};
  return kKernels;
}

}  // namespace locus
