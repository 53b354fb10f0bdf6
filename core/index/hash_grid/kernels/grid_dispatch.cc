#include "core/index/hash_grid/kernels/grid_dispatch.h"

#include "core/base/instruction_set.h"

namespace locus {

const GridKernels& active_grid_kernels() {
#ifdef LOCUS_X86_KERNELS
  if (active_instruction_set() == InstructionSet::kAvx2) return grid_kernels_avx2();
#endif
  return grid_kernels_portable();
}

}  // namespace locus
