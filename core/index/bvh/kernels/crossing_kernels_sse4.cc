// Crossing kernels compiled for x86-64-v2 (SSE 4.2).
#include "core/index/bvh/kernels/crossing_kernels_impl.h"

namespace locus {

const CrossingKernels& crossing_kernels_sse4() {
  static constexpr CrossingKernels kKernels = {"sse4", sum_crossings};
  return kKernels;
}

}  // namespace locus
