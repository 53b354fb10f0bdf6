// Work counters: the cost of a query in units that do not depend on the machine. Plain data, one object per query or
// batch. A repeated query on the same structure results in the same counts.
#ifndef LOCUS_CORE_INDEX_WORK_H_
#define LOCUS_CORE_INDEX_WORK_H_

#include <cstdint>

namespace locus {

struct Work {
  uint64_t nodes = 0;  // tree nodes opened
  uint64_t cells = 0;  // grid bricks looked up, plus rows of values scanned in them; bounds compared in lists
  uint64_t tests = 0;  // values tested: passed to a visitor, or tested by a vector kernel or as a pair

  Work& operator+=(const Work& other) {
    nodes += other.nodes;
    cells += other.cells;
    tests += other.tests;
    return *this;
  }
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_WORK_H_
