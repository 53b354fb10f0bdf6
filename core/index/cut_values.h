// Option for the place of values that a dividing plane cuts, and the set by which a visit passes each of them once.
// Used by structures that divide space.
#ifndef LOCUS_CORE_INDEX_CUT_VALUES_H_
#define LOCUS_CORE_INDEX_CUT_VALUES_H_

#include <cstdint>

#include "absl/container/flat_hash_set.h"

namespace locus {

// Place of a value that a dividing plane cuts. In the leaves, the value is listed in every leaf that its bounds touch,
// and a query tests only the values near it. At the node, the value is stored once, but every query that reaches the
// node tests all values there: over boxes, the work of a small query grows by a power of the number of values.
enum class CutValues : uint8_t { kInLeaves, kAtNode };

// Set of the values that a visit has passed and that it can meet again, because they lie in several leaves or cells.
// The caller must not ask for values that lie in one leaf: they cost nothing. One object per visit; one thread.
class PassedValues {
 public:
  // Returns true for the first call with this number or id of a value.
  bool add(uint64_t number) { return passed_.insert(number).second; }

 private:
  absl::flat_hash_set<uint64_t> passed_;  // allocates no memory until the first value is added
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_CUT_VALUES_H_
