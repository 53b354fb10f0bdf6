// Batcher of single queries from many callers. Queries that arrive within a short time are sent in one message, and
// each query has a callback for its answer. For game code with scattered queries; code that has a thousand queries at
// the same time builds one batch of them with QueryBuilder instead.
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
#include "client/lib/options.h"
#include "client/lib/query_blocks.h"
#include "client/lib/query_stream.h"
#include "client/lib/result_rows.h"

namespace locus::client {

// Query for the nearest hit of one ray. Positions of queries are relative to QueryBatcherOptions::frame.
struct SingleRay {
  Float3 origin;
  Float3 direction;                                      // any length except zero; this length is the unit of t
  float t_max = std::numeric_limits<float>::infinity();  // maximum t, inclusive
  Filter filter = {};
};

// Nearest hit; a miss has t = +infinity, id 0 and kNoTriangle.
struct SingleHit {
  float t = std::numeric_limits<float>::infinity();
  uint64_t id = 0;
  uint32_t triangle = kNoTriangle;
};

// Query for the objects and instances that overlap one ball.
struct SingleBall {
  Float3 center;
  float radius = 0;
  Filter filter = {};
};

struct QueryBatcherOptions {
  GatherLimits limits = {};
  // Origin of all positions: the server adds it to the position of each query.
  Double3 frame = {};
};

// Thread-safe: every method may be called from any thread. Callbacks run on threads of the library and must not block
// or call the batcher. They run one at a time until the stream ends; after that, callbacks with the stream's error may
// overlap.
class QueryBatcher {
 public:
  using HitCallback = std::function<void(absl::StatusOr<SingleHit>)>;
  // Callback with the ids of all objects and instances found, ascending.
  using IdsCallback = std::function<void(absl::StatusOr<std::vector<uint64_t>>)>;

  explicit QueryBatcher(std::unique_ptr<QueryStream> stream, const QueryBatcherOptions& options = {});
  // Sends the gathered queries and waits for all answers.
  ~QueryBatcher();
  QueryBatcher(const QueryBatcher&) = delete;
  QueryBatcher& operator=(const QueryBatcher&) = delete;

  // Add a query. The callback is called exactly once, with the answer or with the error of the message that contained
  // the query. If one query has an invalid value, for example NaN, the server refuses all queries of the same message.
  // Both functions block while `max_items` queries are waiting to be sent.
  void ray(const SingleRay& ray, HitCallback on_hit);
  void ball(const SingleBall& ball, IdsCallback on_ids);

  // Sends the gathered queries without further delay. Blocks until all queries added before this call are answered.
  void flush();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_QUERY_BATCHER_H_
