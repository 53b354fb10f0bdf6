// Compiled for AVX-512 with vectors of 256 bits.
#include "core/index/bvh/kernels/ray_kernels_impl.h"

namespace locus {

const RayKernels& ray_kernels_avx512() {
  static constexpr RayKernels kKernels = {"avx512", trace<false>, trace<true>};
  return kKernels;
}

}  // namespace locus
