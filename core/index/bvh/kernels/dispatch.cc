#include "core/index/bvh/kernels/dispatch.h"

namespace locus {

const RayKernels* active_ray_kernels() {
#ifdef LOCUS_X86_KERNELS
  if (active_instruction_set() == InstructionSet::kAvx2) return &ray_kernels_avx2();
  if (active_instruction_set() == InstructionSet::kSse4) return &ray_kernels_sse4();
#endif
  return nullptr;
}

const RegionKernels* active_region_kernels() {
#ifdef LOCUS_X86_KERNELS
  if (active_instruction_set() == InstructionSet::kAvx2) return &region_kernels_avx2();
  if (active_instruction_set() == InstructionSet::kSse4) return &region_kernels_sse4();
#endif
  return nullptr;
}

const NearestKernels* active_nearest_kernels() {
#ifdef LOCUS_X86_KERNELS
  if (active_instruction_set() == InstructionSet::kAvx2) return &nearest_kernels_avx2();
  if (active_instruction_set() == InstructionSet::kSse4) return &nearest_kernels_sse4();
#endif
  return nullptr;
}

const CrossingKernels* active_crossing_kernels() {
#ifdef LOCUS_X86_KERNELS
  if (active_instruction_set() == InstructionSet::kAvx2) return &crossing_kernels_avx2();
  if (active_instruction_set() == InstructionSet::kSse4) return &crossing_kernels_sse4();
#endif
  return nullptr;
}

}  // namespace locus
