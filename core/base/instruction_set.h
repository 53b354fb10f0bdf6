// Which instruction set the vector code of this process uses: the widest the processor has, unless one is named. The
// choice is made once; answers do not depend on it.
#ifndef LOCUS_CORE_BASE_INSTRUCTION_SET_H_
#define LOCUS_CORE_BASE_INSTRUCTION_SET_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus {

enum class InstructionSet : uint8_t { kPortable, kSse4, kAvx2 };

// The name of the code that runs on any processor.
inline constexpr char kPortable[] = "portable";

// "avx2", "sse4", "portable".
absl::string_view instruction_set_name(InstructionSet set);

// What this processor can run, the widest first; kPortable is the last. Thread-safe.
std::vector<std::string> instruction_sets();

// From now on that instruction set serves; empty = the widest. INVALID_ARGUMENT naming those there are. For the start
// of a program and for tests: not while queries run.
absl::Status use_instruction_set(absl::string_view name);

// The one in use. Thread-safe.
InstructionSet active_instruction_set();
inline absl::string_view instruction_set() { return instruction_set_name(active_instruction_set()); }

}  // namespace locus

#endif  // LOCUS_CORE_BASE_INSTRUCTION_SET_H_
