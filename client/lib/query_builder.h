// Builder of a query batch: blocks of columns, which are answered together at one revision. For callers of
// Client::query and QueryStream. Not thread-safe. build() resets the builder and invalidates the blocks returned by it.
#ifndef LOCUS_CLIENT_LIB_QUERY_BUILDER_H_
#define LOCUS_CLIENT_LIB_QUERY_BUILDER_H_

#include <cstdint>

#include "client/lib/query_blocks.h"
#include "client/lib/values.h"
#include "locus/v1/query_service.pb.h"

namespace locus::client {

class QueryBuilder {
 public:
  // Sets the oldest acceptable revision, for example that of an ack ("read your own writes"). The default is the
  // latest.
  QueryBuilder& at_least(const Revision& revision);
  // Requests exactly this revision, as long as the server keeps it.
  QueryBuilder& exactly(const Revision& revision);
  // Sets the work budget in nodes, cells and tests; 0 = no limit.
  QueryBuilder& max_work(uint64_t work);
  // Requests a report of the work done.
  QueryBuilder& explain();
  // Sets the maximum size of the reply; 0 = 4,000,000.
  QueryBuilder& max_reply_bytes(uint32_t bytes);

  // Open the next block; at most 256 per batch.
  RayBlock rays() { return RayBlock(*batch_.add_blocks()); }
  BallBlock balls() { return BallBlock(*batch_.add_blocks()); }
  BoxBlock boxes() { return BoxBlock(*batch_.add_blocks()); }
  NearestBlock nearest() { return NearestBlock(*batch_.add_blocks()); }
  LookupBlock lookup() { return LookupBlock(*batch_.add_blocks()); }

  // Returns the batch, and leaves the builder empty with every setting at its default.
  v1::QueryBatch build();

 private:
  v1::QueryBatch batch_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_QUERY_BUILDER_H_
