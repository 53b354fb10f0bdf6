// Square roots of whole numbers, for generators that turn a number of triangles into a number of rows. A function
// without state.
#ifndef LOCUS_CLIENT_CLI_LEVELS_GENERATE_WHOLE_ROOT_H_
#define LOCUS_CLIENT_CLI_LEVELS_GENERATE_WHOLE_ROOT_H_

#include <cstdint>

namespace locus::cli {

// The largest r with r * r <= n, for n up to 2^62.
constexpr uint64_t whole_root(uint64_t n) {
  uint64_t root = 0;
  for (uint64_t bit = uint64_t{1} << 31; bit != 0; bit >>= 1)
    if ((root + bit) * (root + bit) <= n) root += bit;
  return root;
}

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_GENERATE_WHOLE_ROOT_H_
