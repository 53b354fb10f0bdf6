// Writes a query batch: blocks in columns, answered together at one revision. For callers of Client::query and
// QueryStream. Not thread-safe. A builder is spent by build(), which also ends the blocks got from it.
#ifndef LOCUS_CLIENT_LIB_QUERY_BUILDER_H_
#define LOCUS_CLIENT_LIB_QUERY_BUILDER_H_

#include <cstdint>

#include "client/lib/query_blocks.h"
#include "client/lib/values.h"
#include "locus/v1/query_service.pb.h"

namespace locus::client {

class QueryBuilder {
 public:
  // The oldest revision that will do, for example an ack's ("read your own writes"). The default is the latest.
  QueryBuilder& at_least(const Revision& revision);
  // This very revision, as long as the server keeps it.
  QueryBuilder& exactly(const Revision& revision);
  // A budget in nodes, cells and tests; 0 = none.
  QueryBuilder& max_work(uint64_t work);
  // Reports the work done.
  QueryBuilder& explain();
  // 0 = 4,000,000.
  QueryBuilder& max_reply_bytes(uint32_t bytes);

  // Each opens the next block; at most 256 a batch.
  RayBlock rays() { return RayBlock(*batch_.add_blocks()); }
  BallBlock balls() { return BallBlock(*batch_.add_blocks()); }
  BoxBlock boxes() { return BoxBlock(*batch_.add_blocks()); }
  NearestBlock nearest() { return NearestBlock(*batch_.add_blocks()); }
  LookupBlock lookup() { return LookupBlock(*batch_.add_blocks()); }

  // The batch so far; the builder is left empty, with every setting at its default.
  v1::QueryBatch build();

 private:
  v1::QueryBatch batch_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_QUERY_BUILDER_H_
