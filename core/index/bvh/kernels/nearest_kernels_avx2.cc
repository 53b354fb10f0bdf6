// Nearest kernels compiled for AVX2 and FMA.
#include "core/index/bvh/kernels/nearest_kernels_impl.h"
#include "core/index/bvh/kernels/nearest_measure_impl.h"

namespace locus {

const NearestKernels& nearest_kernels_avx2() {
  static constexpr NearestKernels kKernels = {"avx2", find_nearest, measure_candidates};
  return kKernels;
}

}  // namespace locus
