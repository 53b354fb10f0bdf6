// Region kernels compiled for AVX2 and FMA.
#include "core/index/bvh/kernels/region_kernels_impl.h"

namespace locus {

const RegionKernels& region_kernels_avx2() {
  static constexpr RegionKernels kKernels = {"avx2", kernel_of<BallQuery, KernelBall>(),
                                             kernel_of<BoxQuery<false>, KernelBox>(),
                                             kernel_of<BoxQuery<true>, KernelBox>()};
  return kKernels;
}

}  // namespace locus
