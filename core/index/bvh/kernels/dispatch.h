// Selection of the ray, region, nearest and crossing kernels for the instruction set that this process uses.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_DISPATCH_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_DISPATCH_H_

#include "core/base/instruction_set.h"
#include "core/index/bvh/kernels/crossing_kernels.h"
#include "core/index/bvh/kernels/nearest_kernels.h"
#include "core/index/bvh/kernels/ray_kernels.h"
#include "core/index/bvh/kernels/region_kernels.h"

namespace locus {

// Return the kernels of active_instruction_set(); null for InstructionSet::kPortable. Thread-safe.
const RayKernels* active_ray_kernels();
const RegionKernels* active_region_kernels();
const NearestKernels* active_nearest_kernels();
const CrossingKernels* active_crossing_kernels();

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_DISPATCH_H_
