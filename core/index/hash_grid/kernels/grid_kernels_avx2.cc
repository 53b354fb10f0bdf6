// Hash grid kernels compiled for AVX2.
#include "core/index/hash_grid/kernels/grid_kernels_impl.h"

namespace locus {

const GridKernels& grid_kernels_avx2() {
  static constexpr GridKernels kKernels = {"avx2",
                                           cull_box<Marks::kNone>,
                                           cull_line,
                                           cull_ball<Marks::kNone>,
                                           cull_box<Marks::kInside>,
                                           cull_ball<Marks::kInside>,
                                           collect_near,
                                           sort_few};
  return kKernels;
}

}  // namespace locus
