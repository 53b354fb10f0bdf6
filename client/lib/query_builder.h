// Builder of a query batch: blocks of columns, which are answered together at one revision. For callers of
// Client::query and QueryStream. Not thread-safe. build() resets the QueryBuilder and invalidates all block builders
// that this QueryBuilder has returned.
#ifndef LOCUS_CLIENT_LIB_QUERY_BUILDER_H_
#define LOCUS_CLIENT_LIB_QUERY_BUILDER_H_

#include <cstdint>

#include "client/lib/query_blocks.h"
#include "client/lib/values.h"
#include "locus/v1/query_service.pb.h"

namespace locus::client {

class QueryBuilder {
 public:
  // Requires an answer at `revision` or later, for example at the revision of an ack ("read your own writes"). The
  // server waits until the scene has reached this revision. By default the server answers at the latest revision
  // without waiting.
  QueryBuilder& at_least(const Revision& revision);
  // Requests exactly this revision. The query fails with OUT_OF_RANGE if the server no longer retains it.
  QueryBuilder& exactly(const Revision& revision);
  // Sets the maximum work for the batch: the sum of visited tree nodes, visited grid cells, tested triangles and tested
  // objects; 0 = no limit.
  QueryBuilder& max_work(uint64_t work);
  // Requests a report of the work done for the batch.
  QueryBuilder& explain();
  // Tests every triangle and object instead of searching the structures of the scene. The result blocks have the same
  // bytes, so that a caller can verify the server's answers, but cost far more time and work.
  QueryBuilder& by_list();
  // Sets the maximum size of the reply in bytes; 0 = the default of 4,000,000.
  QueryBuilder& max_reply_bytes(uint32_t bytes);

  // Append a block to the batch, which may have at most 256 blocks.
  RayBlock rays() { return RayBlock(*batch_.add_blocks()); }
  BallBlock balls() { return BallBlock(*batch_.add_blocks()); }
  BoxBlock boxes() { return BoxBlock(*batch_.add_blocks()); }
  CapsuleBlock capsules() { return CapsuleBlock(*batch_.add_blocks()); }
  SweepBlock sweeps() { return SweepBlock(*batch_.add_blocks()); }
  FrustumBlock frustums() { return FrustumBlock(*batch_.add_blocks()); }
  ContainsBlock contains() { return ContainsBlock(*batch_.add_blocks()); }
  SightBlock sight() { return SightBlock(*batch_.add_blocks()); }
  PairBlock pairs() { return PairBlock(*batch_.add_blocks()); }
  CellBlock cells() { return CellBlock(*batch_.add_blocks()); }
  NearestBlock nearest() { return NearestBlock(*batch_.add_blocks()); }
  LookupBlock lookup() { return LookupBlock(*batch_.add_blocks()); }

  // Returns the batch, and leaves the builder empty with every setting at its default.
  v1::QueryBatch build();

 private:
  v1::QueryBatch batch_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_QUERY_BUILDER_H_
