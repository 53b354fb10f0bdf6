// A steady flow of update batches into one scene: pipelined, and applied exactly once each even across broken
// connections. For game servers that send a batch a tick.
//
// Each batch carries the stream's random `writer` number and a dense `batch` number. When the connection breaks, every
// batch without an ack is sent again, in order, on a new one; the server answers what it had applied with
// `duplicate`. A batch that the server refuses does not use up its number, so the batches behind it are renumbered and
// sent again by themselves: the caller sees one outcome for each batch, in the order sent.
//
// The stream ends for good when the server refuses it (the scene's name, lost rights), when it forgot the writer (its
// memory was lost: the scene started over), or when reconnecting fails as often as the policy allows without an ack in
// between. Then every unanswered batch gets that status, and so does every send() from then on. Their outcome is
// unknown; what was acked before stays applied.
#ifndef LOCUS_CLIENT_LIB_UPDATE_STREAM_H_
#define LOCUS_CLIENT_LIB_UPDATE_STREAM_H_

#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/lib/options.h"
#include "client/lib/values.h"
#include "locus/v1/update_service.pb.h"

namespace grpc {
class ChannelInterface;
}

namespace locus::client {

struct UpdateStreamOptions {
  // Batches under way at once, 1 or more. send() blocks at this number: that is how the server's pace reaches the
  // caller.
  int max_in_flight = 8;
  // 0 draws a random number. Give one, and `next_batch`, only to go on with a writer of an earlier stream.
  uint64_t writer = 0;
  uint64_t next_batch = 1;
  // For new connections after a break. An ack starts the count anew.
  RetryPolicy reconnect = {.max_attempts = 10};
  // So long may the server ack nothing while batches are under way; then the connection counts as broken.
  absl::Duration patience = absl::Seconds(10);
  // kLatency where batches are small and acks wanted at once.
  Lane lane = Lane::kBulk;
};

// Thread promise: every method may be called from any thread; batches of several threads are numbered in the order in
// which their send() gets in. Callbacks come one at a time, in the order of the batches, on a thread of the library:
// they must not block, nor call send(), flush(), close() or the destructor.
class UpdateStream {
 public:
  using AckCallback = std::function<void(absl::StatusOr<v1::UpdateAck>)>;

  // Use Client::update_stream.
  UpdateStream(std::shared_ptr<grpc::ChannelInterface> channel, std::string scene, const UpdateStreamOptions& options);
  // Breaks the stream off; unanswered batches get CANCELLED. close() first to end in peace.
  ~UpdateStream();
  UpdateStream(const UpdateStream&) = delete;
  UpdateStream& operator=(const UpdateStream&) = delete;

  // Blocks while `max_in_flight` batches are unanswered. OK means that `on_ack` will be called exactly once; an error
  // means that the stream has ended and it never will. The batch's own `writer` and `batch` are overwritten.
  absl::Status send(v1::UpdateBatch batch, AckCallback on_ack);
  // The same with a future, which also gets the error of a stream that has ended.
  std::future<absl::StatusOr<v1::UpdateAck>> send(v1::UpdateBatch batch);

  // Blocks until all that was sent has been answered and its callbacks have returned; the stream's error if it ended
  // instead.
  absl::Status flush();
  // flush(), then ends the stream. Later sends fail.
  absl::Status close();

  // Where the latest ack put its batch. A query with QueryBuilder::at_least() of it sees every batch acked so far.
  std::optional<Revision> last_ack() const;
  uint64_t writer() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_UPDATE_STREAM_H_
