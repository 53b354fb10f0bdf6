// Pipelined stream of query batches against one scene, and of steps: an update with queries that see it. Answers may
// arrive in any order and are matched by sequence number. For callers that query every tick. After a broken connection,
// unanswered batches are sent again on a new connection, which is safe: queries change nothing, and each step's update
// carries the stream's random writer id and a consecutive batch number, by which the server applies it only once.
//
// A refused update does not use up its number, as in an UpdateStream: the stream renumbers the later steps and sends
// everything after the refused step again. A step that is refused when it is sent again may have been applied: its
// error then has no reason and says so. The stream ends permanently in the cases in which an UpdateStream ends.
#ifndef LOCUS_CLIENT_LIB_QUERY_STREAM_H_
#define LOCUS_CLIENT_LIB_QUERY_STREAM_H_

#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/lib/options.h"
#include "locus/v1/query_service.pb.h"
#include "locus/v1/update_service.pb.h"

namespace locus::client {

class Router;

// Outcome of a step whose update was applied, except refused items.
struct StepResult {
  v1::UpdateAck ack;
  // The answer to the queries, at the revision of the ack or a later one; or their error. The update stays applied if
  // the queries fail.
  absl::StatusOr<v1::QueryResult> result;
};

struct QueryStreamOptions {
  // Maximum number of unanswered batches, at least 1; send() blocks when this number is reached. 8 batches of 1,024
  // queries, or 2 batches of 8,192 queries, keep a local server busy.
  int max_in_flight = 8;
  // Reconnection after a broken connection. Every answer resets the count of attempts.
  RetryPolicy reconnect = {};
  // Maximum time without any answer while batches are unanswered. After this time the connection counts as broken. Must
  // be longer than the server needs for the largest batch.
  absl::Duration patience = absl::Seconds(10);
  // Connection of the stream. Use kLatency for small batches whose answers are needed quickly.
  Lane lane = Lane::kBulk;
  // Writer id of the steps; 0 = the stream generates a random id. `next_batch` is the number of the first step. Set
  // these two options only to continue the batch numbers of an earlier stream's writer.
  uint64_t writer = 0;
  uint64_t next_batch = 1;
  // Lease of the steps, as UpdateStreamOptions::lease; it begins with the first step.
  absl::Duration lease = absl::ZeroDuration();
};

// Thread-safe: every method may be called from any thread. Callbacks run one at a time, in the order of the answers, on
// a thread of the library: they must not block, or call send(), flush(), close() or the destructor.
class QueryStream {
 public:
  using ResultCallback = std::function<void(absl::StatusOr<v1::QueryResult>)>;
  using StepCallback = std::function<void(absl::StatusOr<StepResult>)>;

  // Opens a stream to the servers of `router`. Callers use Client::query_stream instead.
  QueryStream(std::shared_ptr<Router> router, std::string scene, const QueryStreamOptions& options);
  // Cancels the stream; unanswered batches get CANCELLED.
  ~QueryStream();
  QueryStream(const QueryStream&) = delete;
  QueryStream& operator=(const QueryStream&) = delete;

  // Sends a batch. Blocks while `max_in_flight` batches are unanswered. Returns OK if `on_result` will be called
  // exactly once, with the answer or the error of this batch; returns an error if the stream has ended, and then never
  // calls `on_result`.
  absl::Status send(v1::QueryBatch batch, ResultCallback on_result);
  // Sends a batch and returns a future for its answer. If the stream has ended, the future receives the stream's error.
  std::future<absl::StatusOr<v1::QueryResult>> send(v1::QueryBatch batch);

  // Sends a step: the server applies `update`, then answers `queries` at a revision that contains it. Otherwise like
  // send(). An error with a reason means that the step was refused: nothing was changed and no query was run. Steps are
  // applied in the order sent. Overwrites `writer` and `batch` of the update.
  absl::Status step(v1::UpdateBatch update, v1::QueryBatch queries, StepCallback on_result);
  std::future<absl::StatusOr<StepResult>> step(v1::UpdateBatch update, v1::QueryBatch queries);

  // Blocks until all sent batches are answered and their callbacks have returned. If the stream has ended, returns the
  // stream's error.
  absl::Status flush();
  // Flushes and ends the stream. Later sends fail.
  absl::Status close();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_QUERY_STREAM_H_
