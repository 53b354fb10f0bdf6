// The load generator: bidirectional calls with a connection each and a window of messages in flight on each. The thread
// that calls run() drives all calls by one completion queue, since blocking clients, or one thread per connection,
// would use more processor time than the measured server. Messages are serialized and parsed as by any client. One
// thread at a time.
#ifndef LOCUS_TESTS_BENCH_SERVING_STREAM_LOAD_H_
#define LOCUS_TESTS_BENCH_SERVING_STREAM_LOAD_H_

#include <grpcpp/client_context.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/support/async_stream.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "tests/bench/frame/race.h"

namespace locus::bench::serving {

// Maximum time without a message from the server. After that, run() assumes that the server hangs, and returns an
// error.
inline constexpr std::chrono::seconds kSilence{60};

inline absl::Status failed(const grpc::Status& status) {
  return absl::Status(static_cast<absl::StatusCode>(status.error_code()), status.error_message());
}

template <class Request, class Response>
class StreamLoad {
 public:
  using Call = grpc::ClientAsyncReaderWriter<Request, Response>;
  // Function that opens a call, for example by stub.AsyncStreamQueries.
  using Open = std::function<std::unique_ptr<Call>(grpc::ClientContext*, grpc::CompletionQueue*, void* tag)>;
  // Function that returns the next message and sets `number`, which identifies the message to Reply; nullptr = there
  // are no more. run() sets the message's `sequence`.
  using Next = std::function<Request*(uint64_t& number)>;
  // Function that is called with an answer, the number of its message, and the time since the message was written.
  using Reply = std::function<void(uint64_t number, const Response& response, double seconds)>;

  explicit StreamLoad(const Open& open) : StreamLoad(std::vector<Open>{open}) {}

  explicit StreamLoad(const std::vector<Open>& opens) {
    for (const Open& open : opens) {
      Stream& stream = *streams_.emplace_back(std::make_unique<Stream>());
      stream.call = open(&stream.context, &queue_, &stream.started);
    }
    for (size_t started = 0; alive_ && started < streams_.size(); ++started) {
      const Event* const event = await();
      alive_ = event != nullptr && event->what == kStarted && ok_;
    }
    for (const auto& stream : streams_)
      if (alive_) stream->call->Read(&stream->response, &stream->read);
  }

  ~StreamLoad() {
    for (const auto& stream : streams_) stream->context.TryCancel();
    queue_.Shutdown();
    void* ignored = nullptr;
    bool ok = false;
    while (queue_.Next(&ignored, &ok)) {
    }
  }
  StreamLoad(const StreamLoad&) = delete;
  StreamLoad& operator=(const StreamLoad&) = delete;

  // Keeps `window` messages in flight on the only stream until `next` has no more and all are answered.
  absl::Status run(size_t window, const Next& next, const Reply& reply) {
    return run(window, std::vector<Next>{next}, reply);
  }

  // Keeps `window` messages in flight on every stream; next[i] returns the messages of stream i.
  absl::Status run(size_t window, const std::vector<Next>& next, const Reply& reply) {
    for (size_t i = 0; i < streams_.size(); ++i) {
      streams_[i]->begin(window, next[i]);
      if (alive_) streams_[i]->write();
    }
    while (alive_ && std::any_of(streams_.begin(), streams_.end(), [](const auto& stream) { return stream->busy(); })) {
      const Event* const event = await();
      if (event == nullptr) return end(*streams_.front());
      Stream& stream = *event->stream;
      if (event->what == kRead) {
        if (!ok_ || !stream.take(reply)) return end(stream);
        stream.call->Read(&stream.response, &stream.read);
      } else if (event->what == kWritten) {
        stream.writing = false;
      } else {
        return end(stream);
      }
      stream.write();
    }
    return alive_ ? absl::OkStatus() : end(*streams_.front());
  }

 private:
  enum What : uint8_t { kStarted, kRead, kWritten, kFinished };
  struct Stream;
  struct Event {
    Stream* stream;
    What what;
  };
  struct Slot {
    uint64_t number = 0;
    double written = 0;
  };

  struct Stream {
    bool busy() const { return more || writing || free.size() < slots.size(); }

    void begin(size_t window, const Next& from) {
      slots.assign(window, {});
      free.clear();
      for (size_t i = 0; i < window; ++i) free.push_back(i);
      more = true;
      next = from;
    }

    void write() {
      if (writing || !more || free.empty()) return;
      uint64_t number = 0;
      Request* const request = next(number);
      if (request == nullptr) {
        more = false;
        return;
      }
      const size_t slot = free.back();
      free.pop_back();
      slots[slot] = {number, wall_seconds()};
      request->set_sequence(slot);
      writing = true;
      call->Write(*request, &written);
    }

    // Processes the received answer; returns false if its sequence number is not the number of a slot.
    bool take(const Reply& reply) {
      const size_t slot = response.sequence();
      if (slot >= slots.size()) return false;
      free.push_back(slot);
      reply(slots[slot].number, response, wall_seconds() - slots[slot].written);
      return true;
    }

    Event started{this, kStarted}, read{this, kRead}, written{this, kWritten}, finished{this, kFinished};
    grpc::ClientContext context;
    std::unique_ptr<Call> call;
    Response response;
    Next next;
    std::vector<Slot> slots;
    std::vector<size_t> free;
    bool more = false;
    bool writing = false;
  };

  // Returns the next event; null if there is none within kSilence.
  Event* await() {
    void* event = nullptr;
    const auto deadline = std::chrono::system_clock::now() + kSilence;
    if (queue_.AsyncNext(&event, &ok_, deadline) != grpc::CompletionQueue::GOT_EVENT) return nullptr;
    return static_cast<Event*>(event);
  }

  // Cancels all streams, and returns the error with which `stream` ended.
  absl::Status end(Stream& stream) {
    alive_ = false;
    grpc::Status status;
    for (const auto& each : streams_) each->context.TryCancel();
    stream.call->Finish(&status, &stream.finished);
    for (const Event* event = await(); event != &stream.finished; event = await())
      if (event == nullptr) return absl::DeadlineExceededError("the server keeps silent");
    return status.ok() ? absl::DataLossError("the server ended the stream") : failed(status);
  }

  grpc::CompletionQueue queue_;
  std::vector<std::unique_ptr<Stream>> streams_;
  bool ok_ = false;
  bool alive_ = true;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_STREAM_LOAD_H_
