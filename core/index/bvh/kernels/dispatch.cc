#include "core/index/bvh/kernels/dispatch.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace locus {
namespace {

struct Kernels {
  absl::string_view name = kPortable;
  const RayKernels* rays = nullptr;
  const RegionKernels* regions = nullptr;
};

// What this processor runs, the widest first.
std::vector<Kernels> available() {
  std::vector<Kernels> kernels;
#ifdef LOCUS_X86_KERNELS
  const bool sse4 = __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt");
  const bool avx2 = sse4 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                    __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
  if (avx2) kernels.push_back({ray_kernels_avx2().name, &ray_kernels_avx2(), &region_kernels_avx2()});
  if (sse4) kernels.push_back({ray_kernels_sse4().name, &ray_kernels_sse4(), &region_kernels_sse4()});
#endif
  kernels.emplace_back();
  return kernels;
}

// Written by use_instruction_set() only.
Kernels& active() {
  static Kernels kernels = available().front();
  return kernels;
}

}  // namespace

std::vector<std::string> instruction_sets() {
  std::vector<std::string> names;
  for (const Kernels& kernels : available()) names.emplace_back(kernels.name);
  return names;
}

absl::Status use_instruction_set(absl::string_view name) {
  for (const Kernels& kernels : available()) {
    if (!name.empty() && name != kernels.name) continue;
    active() = kernels;
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat("this processor does not run the instruction set '", name,
                                                 "'; it runs: ", absl::StrJoin(instruction_sets(), ", ")));
}

absl::string_view instruction_set() { return active().name; }

const RayKernels* active_ray_kernels() { return active().rays; }

const RegionKernels* active_region_kernels() { return active().regions; }

}  // namespace locus
