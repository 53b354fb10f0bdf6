// Which kernels serve on this machine: the widest instruction set the processor has, unless one is named. The choice is
// made once; answers do not depend on it.
#ifndef LOCUS_CORE_INDEX_BVH_KERNELS_DISPATCH_H_
#define LOCUS_CORE_INDEX_BVH_KERNELS_DISPATCH_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "core/index/bvh/kernels/ray_kernels.h"
#include "core/index/bvh/kernels/region_kernels.h"

namespace locus {

// The name of the code without kernels, which runs on any processor.
inline constexpr char kPortable[] = "portable";

// What this processor can run, the widest first; kPortable is the last. Thread-safe.
std::vector<std::string> instruction_sets();

// From now on that instruction set serves; empty = the widest. INVALID_ARGUMENT naming those there are. For the start
// of a program and for tests: not while queries run.
absl::Status use_instruction_set(absl::string_view name);

// The one in use. Thread-safe.
absl::string_view instruction_set();

// Null for kPortable. Thread-safe.
const RayKernels* active_ray_kernels();
const RegionKernels* active_region_kernels();

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_KERNELS_DISPATCH_H_
