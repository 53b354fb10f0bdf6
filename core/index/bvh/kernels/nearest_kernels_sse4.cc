// Nearest kernels compiled for x86-64-v2 (SSE 4.2).
#include "core/index/bvh/kernels/nearest_kernels_impl.h"
#include "core/index/bvh/kernels/nearest_measure_impl.h"

namespace locus {

const NearestKernels& nearest_kernels_sse4() {
  static constexpr NearestKernels kKernels = {"sse4", find_nearest, measure_candidates};
  return kKernels;
}

}  // namespace locus
