// Single queries from many callers in few messages: each is answered by its own callback, and what callers ask within a
// moment travels together. For game code that asks here and there; whoever has a thousand queries at hand builds a
// batch of them.
//
//   locus::client::QueryBatcher batcher(client->query_stream("arena", {.lane = locus::client::Lane::kLatency}));
//   batcher.ray({{0, 1, 0}, {0, 0, -1}}, [](auto hit) { if (hit.ok() && hit->id != 0) shoot(hit->id, hit->t); });
#ifndef LOCUS_CLIENT_LIB_QUERY_BATCHER_H_
#define LOCUS_CLIENT_LIB_QUERY_BATCHER_H_

#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "client/lib/gather_limits.h"
#include "client/lib/query_blocks.h"
#include "client/lib/query_stream.h"
#include "client/lib/result_rows.h"

namespace locus::client {

// Positions are relative to the batcher's frame.
struct SingleRay {
  Float3 origin;
  Float3 direction;                                      // t counts in its lengths
  float t_max = std::numeric_limits<float>::infinity();  // included
  Filter filter = {};
};

// The nearest hit; a miss has t = +infinity, id 0 and kNoTriangle.
struct SingleHit {
  float t = std::numeric_limits<float>::infinity();
  uint64_t id = 0;
  uint32_t triangle = kNoTriangle;
};

struct SingleBall {
  Float3 center;
  float radius = 0;
  Filter filter = {};
};

struct QueryBatcherOptions {
  GatherLimits limits = {};
  // Added to every position.
  Double3 frame = {};
};

// Thread promise: every method may be called from any thread. Callbacks come one at a time on a thread of the library:
// they must not block, nor call the batcher.
class QueryBatcher {
 public:
  using HitCallback = std::function<void(absl::StatusOr<SingleHit>)>;
  // Ids ascend.
  using IdsCallback = std::function<void(absl::StatusOr<std::vector<uint64_t>>)>;

  explicit QueryBatcher(std::unique_ptr<QueryStream> stream, const QueryBatcherOptions& options = {});
  // Sends what is left and waits until everything is answered.
  ~QueryBatcher();
  QueryBatcher(const QueryBatcher&) = delete;
  QueryBatcher& operator=(const QueryBatcher&) = delete;

  // The callback is called exactly once: with the answer, or with why its message was not answered. A wrong value, one
  // that is not finite for example, refuses all that travelled with it. Blocks while `max_items` queries wait for a
  // server that does not keep up.
  void ray(const SingleRay& ray, HitCallback on_hit);
  void ball(const SingleBall& ball, IdsCallback on_ids);

  // Sends at once what has been gathered, and blocks until all that was asked before is answered.
  void flush();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_QUERY_BATCHER_H_
