// Region kernels compiled for x86-64-v2 (SSE 4.2).
#include "core/index/bvh/kernels/region_kernels_impl.h"

namespace locus {

const RegionKernels& region_kernels_sse4() {
  static constexpr RegionKernels kKernels = {"sse4", kernel_of<BallQuery, KernelBall>(),
                                             kernel_of<BoxQuery<false>, KernelBox>(),
                                             kernel_of<BoxQuery<true>, KernelBox>()};
  return kKernels;
}

}  // namespace locus
