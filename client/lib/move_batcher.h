// Batcher of single moves from many callers into few messages, each of which becomes one revision. For game code where
// every object moves itself; code that has all positions of a tick builds a batch of them with UpdateBuilder instead.
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
#include "client/lib/options.h"
#include "client/lib/update_stream.h"
#include "client/lib/values.h"

namespace locus::client {

// Thread-safe: every method may be called from any thread. Moves of one caller are applied in the order of its calls.
// If an object is moved twice, the later move wins.
class MoveBatcher {
 public:
  // Callback that is called once for each message, either with the message's ack or with the error of the message or of
  // the stream. An ack lists refused moves (unknown ids). The callback runs on a thread of the library, and must not
  // block or call the batcher.
  using AckCallback = std::function<void(const absl::StatusOr<v1::UpdateAck>&)>;

  explicit MoveBatcher(std::unique_ptr<UpdateStream> stream, const GatherLimits& limits = {}, AckCallback on_ack = {});
  // Sends the gathered moves and waits for all acks.
  ~MoveBatcher();
  MoveBatcher(const MoveBatcher&) = delete;
  MoveBatcher& operator=(const MoveBatcher&) = delete;

  // Adds a move. Blocks while `max_items` moves wait because the server does not keep up. After the stream has ended,
  // moves are dropped, and flush() returns the stream's error.
  void move(uint64_t id, const Position& position, const std::optional<Rotation>& rotation = std::nullopt);

  // Sends the gathered moves without further delay, and blocks until all moves added before this call are acked. If the
  // stream has ended, returns the stream's error.
  absl::Status flush();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_MOVE_BATCHER_H_
