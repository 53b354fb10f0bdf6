// Instruction set that the vector code of this process uses: the widest one that the processor supports, unless the
// configuration names a different instruction set. The process chooses the instruction set once, at the start; query
// results do not depend on the choice.
#ifndef LOCUS_CORE_BASE_INSTRUCTION_SET_H_
#define LOCUS_CORE_BASE_INSTRUCTION_SET_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus {

enum class InstructionSet : uint8_t { kPortable, kSse4, kAvx2 };

// Name of the instruction set that runs on any processor.
inline constexpr char kPortable[] = "portable";

// Returns "avx2", "sse4" or "portable".
absl::string_view instruction_set_name(InstructionSet set);

// Returns the names of the instruction sets that this processor supports, the widest first and kPortable last.
// Thread-safe.
std::vector<std::string> instruction_sets();

// Selects the instruction set `name`, or the widest supported instruction set if `name` is empty. Returns
// INVALID_ARGUMENT, listing the supported names, if the processor does not support `name`. Not thread-safe: call at the
// start of a program or in tests, never while queries run.
absl::Status use_instruction_set(absl::string_view name);

// Returns the instruction set in use. Thread-safe.
InstructionSet active_instruction_set();
inline absl::string_view instruction_set() { return instruction_set_name(active_instruction_set()); }

}  // namespace locus

#endif  // LOCUS_CORE_BASE_INSTRUCTION_SET_H_
