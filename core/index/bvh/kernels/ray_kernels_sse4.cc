// Ray kernels compiled for x86-64-v2 (SSE 4.2).
#include "core/index/bvh/kernels/ray_kernels_impl.h"

namespace locus {

const RayKernels& ray_kernels_sse4() {
  static constexpr RayKernels kKernels = {"sse4", trace_first, trace_any, trace_all};
  return kKernels;
}

}  // namespace locus
