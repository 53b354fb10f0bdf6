// Search for the pairs of objects within a distance of each other. Free functions; any thread may call them with a
// QueryTask of its own.
#ifndef LOCUS_CORE_QUERY_KINDS_PAIR_QUERY_H_
#define LOCUS_CORE_QUERY_KINDS_PAIR_QUERY_H_

#include <vector>

#include "core/query/kinds/hit.h"
#include "core/query/kinds/query_task.h"

namespace locus {

// Row of a pair: the first object, and the id of the second. `first.t` is the distance between the solids or, with
// CONSERVATIVE, between the bounds.
struct PairRow {
  Hit first;
  Id other = kNoId;
};

struct PairAnswer {
  std::vector<PairRow> rows;
  uint64_t count = 0;      // with count_only: the number of rows; `rows` is then empty
  bool truncated = false;  // more rows were found than are returned
};

// Answers the query of a block of pairs. Objects are searched as of `moment`, which the answer borrows. Cost if
// pairs.count is 0: one search around each group of up to 32 objects, and one test in float of each object found
// against each object of the group. Cost otherwise: one search around each object. Memory: at most twice the maximum
// number of rows, plus the rows of one group.
PairAnswer run_pairs(QueryTask& task, const SceneAtTime& moment, const QueryBlock& block, const PairColumns& pairs);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_PAIR_QUERY_H_
