// A steady flow of query batches against one scene: pipelined, answers matched by number whatever order they come in.
// For callers that ask every tick. After a broken connection unanswered batches are asked again on a new one, since
// asking changes nothing.
#ifndef LOCUS_CLIENT_LIB_QUERY_STREAM_H_
#define LOCUS_CLIENT_LIB_QUERY_STREAM_H_

#include <functional>
#include <future>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/lib/options.h"
#include "locus/v1/query_service.pb.h"

namespace grpc {
class ChannelInterface;
}

namespace locus::client {

struct QueryStreamOptions {
  // Batches under way at once, 1 or more; send() blocks at this number. 8 batches of 1,024 queries, or 2 of 8,192, keep
  // a local server busy.
  int max_in_flight = 8;
  // For new connections after a break. An answer starts the count anew.
  RetryPolicy reconnect = {};
  // So long may the server answer nothing while it is asked; then the connection counts as broken. Longer than the
  // largest batch takes.
  absl::Duration patience = absl::Seconds(10);
  // kLatency where batches are small and wanted at once.
  Lane lane = Lane::kBulk;
};

// Thread promise: every method may be called from any thread. Callbacks come one at a time, in the order of the
// answers, on a thread of the library: they must not block, nor call send(), flush(), close() or the destructor.
class QueryStream {
 public:
  using ResultCallback = std::function<void(absl::StatusOr<v1::QueryResult>)>;

  // Use Client::query_stream.
  QueryStream(std::shared_ptr<grpc::ChannelInterface> channel, std::string scene, const QueryStreamOptions& options);
  // Breaks the stream off; unanswered batches get CANCELLED.
  ~QueryStream();
  QueryStream(const QueryStream&) = delete;
  QueryStream& operator=(const QueryStream&) = delete;

  // Blocks while `max_in_flight` batches are unanswered. OK means that `on_result` will be called exactly once, with
  // the answer or the refusal of this batch; an error means that the stream has ended and it never will.
  absl::Status send(v1::QueryBatch batch, ResultCallback on_result);
  // The same with a future, which also gets the error of a stream that has ended.
  std::future<absl::StatusOr<v1::QueryResult>> send(v1::QueryBatch batch);

  // Blocks until all that was sent has been answered and its callbacks have returned; the stream's error if it ended
  // instead.
  absl::Status flush();
  // flush(), then ends the stream. Later sends fail.
  absl::Status close();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_QUERY_STREAM_H_
