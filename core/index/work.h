// Work counters: what a query cost, in units that do not depend on the machine. Plain data, one per query or batch; the
// same query on the same structure always counts the same.
#ifndef LOCUS_CORE_INDEX_WORK_H_
#define LOCUS_CORE_INDEX_WORK_H_

#include <cstdint>

namespace locus {

struct Work {
  uint64_t nodes = 0;  // tree nodes opened
  uint64_t cells = 0;  // grid bricks and cells looked into
  uint64_t tests = 0;  // values given to a visitor

  Work& operator+=(const Work& other) {
    nodes += other.nodes;
    cells += other.cells;
    tests += other.tests;
    return *this;
  }
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_WORK_H_
