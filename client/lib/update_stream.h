// Pipelined stream of update batches into one scene; each batch is applied exactly once, even across broken
// connections. For game servers that send one batch per tick.
//
// Each batch carries the stream's random writer id (`writer`) and a consecutive batch number (`batch`). After a broken
// connection, every batch without an ack is sent again, in order, on a new connection; the server answers batches that
// it had already applied with `duplicate`. A batch that the server refuses does not use up its number, so the stream
// renumbers the later batches and sends them again: the caller gets one outcome for each batch, in the order sent. If a
// batch is refused when it is sent again after a broken connection, the server may have applied it before: its error
// then has no reason and says so, and the stream continues as the server's next answer requires.
//
// A stream with a lease (UpdateStreamOptions::lease) is for objects that must not outlive their writer: when the
// process ends or is cut off, the server removes the objects that the stream inserted. The lease begins with the first
// batch. The stream renews it by empty batches while the caller sends nothing, so a lease lasts as long as the stream
// object is open, however silent the caller is. It runs out after close() or the destructor, after the stream has ended
// with an error, and while the server cannot be reached.
//
// The stream ends permanently in these cases: the server refuses the stream itself (for example because of the scene
// name or of missing rights); the server has lost the state of the writer (because the scene was restarted without its
// state); the server answers a batch with an error that has no reason; as many consecutive calls as the policy allows
// fail without an answer between them. Every unanswered batch and every later send() gets the status of this failure.
// The outcome of the unanswered batches is unknown; acked batches stay applied.
#ifndef LOCUS_CLIENT_LIB_UPDATE_STREAM_H_
#define LOCUS_CLIENT_LIB_UPDATE_STREAM_H_

#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client/lib/options.h"
#include "client/lib/values.h"
#include "locus/v1/update_service.pb.h"

namespace locus::client {

class Router;

struct UpdateStreamOptions {
  // Maximum number of unanswered batches, at least 1. send() blocks when this number is reached, which limits the
  // caller to the rate of the server.
  int max_in_flight = 8;
  // Writer id; 0 = the stream generates a random id. `next_batch` is the number of the first batch. Set these two
  // options only to continue the batch numbers of an earlier stream's writer.
  uint64_t writer = 0;
  uint64_t next_batch = 1;
  // Reconnection after a broken connection. Every answer, ack or error, resets the count of attempts.
  RetryPolicy reconnect = {.max_attempts = 10};
  // Maximum time without any answer while batches are unanswered; after that the connection counts as broken.
  absl::Duration patience = absl::Seconds(10);
  // Connection of the stream. Use kLatency for small batches whose acks are needed quickly.
  Lane lane = Lane::kBulk;
  // Lease of the stream's writer, at most one day, in whole milliseconds (rounded up); 0 = none. When no batch of the
  // stream has arrived for that long, the server removes all objects that the stream inserted. The stream sends an
  // empty batch when a third of the lease has passed without another batch.
  absl::Duration lease = absl::ZeroDuration();
};

// Thread-safe: every method may be called from any thread; batches of several threads are numbered in the order in
// which send() accepts them. Callbacks run one at a time, in the order of the batches, on a thread of the library: they
// must not block, or call send(), flush(), close() or the destructor.
class UpdateStream {
 public:
  using AckCallback = std::function<void(absl::StatusOr<v1::UpdateAck>)>;

  // Opens a stream to the servers of `router`. Callers use Client::update_stream instead.
  UpdateStream(std::shared_ptr<Router> router, std::string scene, const UpdateStreamOptions& options);
  // Cancels the stream; unanswered batches get CANCELLED. To wait for their acks, call close() before the destructor.
  ~UpdateStream();
  UpdateStream(const UpdateStream&) = delete;
  UpdateStream& operator=(const UpdateStream&) = delete;

  // Sends a batch. Blocks while `max_in_flight` batches are unanswered. Returns OK if `on_ack` will be called exactly
  // once; returns an error if the stream has ended, and then never calls `on_ack`. Overwrites `writer` and `batch` of
  // the batch.
  absl::Status send(v1::UpdateBatch batch, AckCallback on_ack);
  // Sends a batch and returns a future for its ack. If the stream has ended, the future receives the stream's error.
  std::future<absl::StatusOr<v1::UpdateAck>> send(v1::UpdateBatch batch);

  // Sends several batches that become one revision: nothing of them is visible before the last is applied, and none is
  // applied if one is refused. For changes that are too large for one message. The batches are applied in the order
  // given. Only the last may have a tick, `all_or_nothing` or `lease_ms`, which then hold for all. Counts as one batch:
  // there is one ack, whose ItemError.message is an index into `batches`, and after a broken connection all are sent
  // again. Otherwise like send(); returns INVALID_ARGUMENT if `batches` is empty.
  absl::Status send_together(std::vector<v1::UpdateBatch> batches, AckCallback on_ack);
  std::future<absl::StatusOr<v1::UpdateAck>> send_together(std::vector<v1::UpdateBatch> batches);

  // Blocks until all sent batches are answered and their callbacks have returned. If the stream has ended, returns the
  // stream's error.
  absl::Status flush();
  // Flushes and ends the stream. Later sends fail.
  absl::Status close();

  // Returns the revision of the latest ack, or nothing before the first ack. A query with this revision in
  // QueryBuilder::at_least() sees every batch acked so far.
  std::optional<Revision> last_ack() const;
  uint64_t writer() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_UPDATE_STREAM_H_
