// Integer square root, for generators that derive a number of rows from a number of triangles. A function without
// state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_GENERATE_WHOLE_ROOT_H_
#define LOCUS_CLIENT_CLI_LEVELS_GENERATE_WHOLE_ROOT_H_

#include <cstdint>

#include "core/base/check.h"

namespace locus::cli {

// Returns the largest r with r * r <= n. Precondition: n <= 2^62.
constexpr uint64_t whole_root(uint64_t n) {
  LOCUS_DCHECK_LE(n, uint64_t{1} << 62);
  uint64_t root = 0;
  for (uint64_t bit = uint64_t{1} << 31; bit != 0; bit >>= 1)
    if ((root + bit) * (root + bit) <= n) root += bit;
  return root;
}

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_GENERATE_WHOLE_ROOT_H_
