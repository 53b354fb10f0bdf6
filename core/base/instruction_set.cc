#include "core/base/instruction_set.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace locus {
namespace {

std::vector<InstructionSet> available() {
  std::vector<InstructionSet> sets;
#ifdef LOCUS_X86_KERNELS
  const bool sse4 = __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt");
  const bool avx2 = sse4 && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
                    __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
  if (avx2) sets.push_back(InstructionSet::kAvx2);
  if (sse4) sets.push_back(InstructionSet::kSse4);
#endif
  sets.push_back(InstructionSet::kPortable);
  return sets;
}

// Returns a reference to the instruction set in use. Only use_instruction_set() writes to it.
InstructionSet& active() {
  static InstructionSet set = available().front();
  return set;
}

}  // namespace

absl::string_view instruction_set_name(InstructionSet set) {
  switch (set) {
    case InstructionSet::kPortable:
      return kPortable;
    case InstructionSet::kSse4:
      return "sse4";
    case InstructionSet::kAvx2:
      return "avx2";
  }
  return "";
}

std::vector<std::string> instruction_sets() {
  std::vector<std::string> names;
  for (const InstructionSet set : available()) names.emplace_back(instruction_set_name(set));
  return names;
}

absl::Status use_instruction_set(absl::string_view name) {
  for (const InstructionSet set : available()) {
    if (!name.empty() && name != instruction_set_name(set)) continue;
    active() = set;
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError(absl::StrCat("this processor does not run the instruction set '", name,
                                                 "'; it runs: ", absl::StrJoin(instruction_sets(), ", ")));
}

InstructionSet active_instruction_set() { return active(); }

}  // namespace locus
