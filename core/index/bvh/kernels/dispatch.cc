#include "core/index/bvh/kernels/dispatch.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace locus {
namespace {

std::vector<const RayKernels*> available() {
  std::vector<const RayKernels*> kernels;
#ifdef LOCUS_X86_KERNELS
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi") &&
                    __builtin_cpu_supports("bmi2");
  if (avx2) kernels.push_back(&ray_kernels_avx2());
#endif
  return kernels;
}

const RayKernels* widest() {
  const std::vector<const RayKernels*> kernels = available();
  return kernels.empty() ? nullptr : kernels.front();
}

// Written by use_instruction_set() only.
const RayKernels*& active() {
  static const RayKernels* kernels = widest();
  return kernels;
}

}  // namespace

std::vector<std::string> instruction_sets() {
  std::vector<std::string> names;
  for (const RayKernels* kernels : available()) names.emplace_back(kernels->name);
  names.emplace_back(kPortable);
  return names;
}

absl::Status use_instruction_set(absl::string_view name) {
  if (name == kPortable) {
    active() = nullptr;
    return absl::OkStatus();
  }
  for (const RayKernels* kernels : available()) {
    if (!name.empty() && name != kernels->name) continue;
    active() = kernels;
    return absl::OkStatus();
  }
  if (name.empty()) {
    active() = nullptr;
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat("this processor does not run the instruction set '", name,
                                                 "'; it runs: ", absl::StrJoin(instruction_sets(), ", ")));
}

absl::string_view instruction_set() {
  const RayKernels* const kernels = active_ray_kernels();
  return kernels == nullptr ? kPortable : kernels->name;
}

const RayKernels* active_ray_kernels() { return active(); }

const RegionKernels* active_region_kernels() {
#ifdef LOCUS_X86_KERNELS
  return active() == nullptr ? nullptr : &region_kernels_avx2();
#else
  return nullptr;
#endif
}

}  // namespace locus
