// Single moves from many callers in few messages, each of which becomes one revision. For game code where every thing
// moves itself; whoever has the positions of a tick at hand builds a batch of them.
//
//   locus::client::MoveBatcher moves(client->update_stream("arena"), {.max_items = 4096});
//   moves.move(7, {0, 0, 30});
#ifndef LOCUS_CLIENT_LIB_MOVE_BATCHER_H_
#define LOCUS_CLIENT_LIB_MOVE_BATCHER_H_

#include <functional>
#include <memory>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/lib/gather_limits.h"
#include "client/lib/update_stream.h"
#include "client/lib/values.h"

namespace locus::client {

// Thread promise: every method may be called from any thread. Moves of one caller are applied in their order; of two
// moves of one object the later stays.
class MoveBatcher {
 public:
  // Called for each message with its ack, which lists refused moves (ids that no object has), or with why the stream
  // ended. On a thread of the library: must not block, nor call the batcher.
  using AckCallback = std::function<void(const absl::StatusOr<v1::UpdateAck>&)>;

  explicit MoveBatcher(std::unique_ptr<UpdateStream> stream, const GatherLimits& limits = {}, AckCallback on_ack = {});
  // Sends what is left and waits for its acks.
  ~MoveBatcher();
  MoveBatcher(const MoveBatcher&) = delete;
  MoveBatcher& operator=(const MoveBatcher&) = delete;

  // Blocks while `max_items` moves wait for a server that does not keep up. Once the stream has ended moves are
  // dropped: see flush().
  void move(uint64_t id, const Position& position, const std::optional<Rotation>& rotation = std::nullopt);

  // Sends at once what has been gathered, and blocks until all that was moved before is acked. The stream's error if it
  // has ended instead.
  absl::Status flush();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_MOVE_BATCHER_H_
