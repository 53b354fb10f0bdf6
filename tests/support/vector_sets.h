// Instruction sets of this processor for which vector kernels exist, as parameters of tests.
#ifndef LOCUS_TESTS_SUPPORT_VECTOR_SETS_H_
#define LOCUS_TESTS_SUPPORT_VECTOR_SETS_H_

#include <string>
#include <vector>

#include "core/base/instruction_set.h"

namespace locus::test {

// Returns instruction_sets() without the last one, which has no vector kernels.
inline std::vector<std::string> sets_with_vector_kernels() {
  std::vector<std::string> names = instruction_sets();
  names.pop_back();
  return names;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_VECTOR_SETS_H_
