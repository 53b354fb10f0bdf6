// Hash grid kernels for any processor: the compiler splits each vector of eight floats into two halves, or into single
// floats.
#include "core/index/hash_grid/kernels/grid_kernels_impl.h"

namespace locus {

const GridKernels& grid_kernels_portable() {
  static constexpr GridKernels kKernels = {"portable",
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
