// Queries that `locus tune` asks: rows of the user's files, or queries made from the scene. A class with the queries of
// files, and a function. Not thread-safe.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TUNE_QUERY_SET_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TUNE_QUERY_SET_H_

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/lib/client.h"

namespace locus::cli {

// Returns the kind of a batch: that of its first block, or "none".
std::string kind_of(const v1::QueryBatch& batch);

// Batches with `explain` set. Of more than kMaxBatches batches of one kind, evenly spaced ones are kept, so that a long
// file is represented from its begin to its end, and a short one beside it as well.
class QuerySet {
 public:
  static constexpr size_t kMaxBatches = 512;

  // Adds a batch; `place` says in messages where it is from.
  void add(v1::QueryBatch batch, const std::string& place);

  struct Entry {
    v1::QueryBatch batch;
    std::string place;
  };
  const std::vector<Entry>& batches() const { return batches_; }
  // Returns the number of queries that were added.
  uint64_t added() const { return added_; }
  // Returns the number of queries of each kind that were added.
  const std::map<std::string, uint64_t>& counts() const { return counts_; }

 private:
  // Batches of one kind.
  struct Kept {
    uint64_t offered = 0;
    uint64_t stride = 1;  // every such batch is kept
    size_t batches = 0;   // in batches_
  };

  std::vector<Entry> batches_;
  std::map<std::string, Kept> kept_;
  std::map<std::string, uint64_t> counts_;
  uint64_t added_ = 0;
};

// Returns rays, balls, boxes and queries of nearest objects around the given positions of objects of `scene`. Their
// lengths are spread around the distance within which an object has eight neighbours, for which the server is asked
// once. Equal scenes and seeds give equal queries. Precondition: `positions` is not empty.
absl::StatusOr<QuerySet> typical_queries(const client::Client& client, const v1::Scene& scene,
                                         const std::vector<std::array<double, 3>>& positions, uint64_t seed);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TUNE_QUERY_SET_H_
