// Ray kernels compiled for AVX2 and FMA.
#include "core/index/bvh/kernels/ray_kernels_impl.h"

namespace locus {

const RayKernels& ray_kernels_avx2() {
  static constexpr RayKernels kKernels = {"avx2", trace_first, trace_any, trace_all};
  return kKernels;
}

}  // namespace locus
