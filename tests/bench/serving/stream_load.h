// The load generator: one bidirectional call on a connection and a completion queue of its own, so many messages under
// way, driven by the thread that runs it. Messages are written and read as any client would: serialised and parsed.
// Blocking clients would take more of the cores than what they measure. One thread at a time.
#ifndef LOCUS_TESTS_BENCH_SERVING_STREAM_LOAD_H_
#define LOCUS_TESTS_BENCH_SERVING_STREAM_LOAD_H_

#include <grpcpp/client_context.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/support/async_stream.h>

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

// So long may a server keep silent before it counts as hung.
inline constexpr std::chrono::seconds kSilence{60};

inline absl::Status failed(const grpc::Status& status) {
  return absl::Status(static_cast<absl::StatusCode>(status.error_code()), status.error_message());
}

template <class Request, class Response>
class StreamLoad {
 public:
  using Call = grpc::ClientAsyncReaderWriter<Request, Response>;
  // stub.AsyncStreamQueries and its like.
  using Open = std::function<std::unique_ptr<Call>(grpc::ClientContext*, grpc::CompletionQueue*, void* tag)>;
  // The next message and a number to know it by; nullptr = there is no more. Its `sequence` is set.
  using Next = std::function<Request*(uint64_t& number)>;
  // An answer, and how long it took since its message was written.
  using Reply = std::function<void(uint64_t number, const Response& response, double seconds)>;

  explicit StreamLoad(const Open& open) {
    call_ = open(&context_, &queue_, tag(kStarted));
    alive_ = await() == kStarted && ok_;
    if (alive_) call_->Read(&response_, tag(kRead));
  }

  ~StreamLoad() {
    context_.TryCancel();
    queue_.Shutdown();
    void* ignored = nullptr;
    bool ok = false;
    while (queue_.Next(&ignored, &ok)) {
    }
  }
  StreamLoad(const StreamLoad&) = delete;
  StreamLoad& operator=(const StreamLoad&) = delete;

  // Keeps `window` messages under way until there are no more and all are answered.
  absl::Status run(size_t window, const Next& next, const Reply& reply) {
    slots_.assign(window, {});
    free_.clear();
    for (size_t i = 0; i < window; ++i) free_.push_back(i);
    more_ = true;
    if (alive_) write(next);
    while (alive_ && (more_ || writing_ || free_.size() < window)) {
      switch (await()) {
        case kRead:
          if (!ok_ || !take(reply)) return end();
          call_->Read(&response_, tag(kRead));
          break;
        case kWritten:
          writing_ = false;
          break;
        default:
          return end();
      }
      write(next);
    }
    return alive_ ? absl::OkStatus() : end();
  }

 private:
  enum Event : intptr_t { kSilent, kStarted, kRead, kWritten, kFinished };
  struct Slot {
    uint64_t number = 0;
    double written = 0;
  };

  static void* tag(Event event) { return reinterpret_cast<void*>(event); }

  Event await() {
    void* event = nullptr;
    const auto deadline = std::chrono::system_clock::now() + kSilence;
    if (queue_.AsyncNext(&event, &ok_, deadline) != grpc::CompletionQueue::GOT_EVENT) return kSilent;
    return static_cast<Event>(reinterpret_cast<intptr_t>(event));
  }

  void write(const Next& next) {
    if (writing_ || !more_ || free_.empty()) return;
    uint64_t number = 0;
    Request* const request = next(number);
    if (request == nullptr) {
      more_ = false;
      return;
    }
    const size_t slot = free_.back();
    free_.pop_back();
    slots_[slot] = {number, wall_seconds()};
    request->set_sequence(slot);
    writing_ = true;
    call_->Write(*request, tag(kWritten));
  }

  // False: an answer to nothing.
  bool take(const Reply& reply) {
    const size_t slot = response_.sequence();
    if (slot >= slots_.size()) return false;
    free_.push_back(slot);
    reply(slots_[slot].number, response_, wall_seconds() - slots_[slot].written);
    return true;
  }

  // Why nothing comes any more.
  absl::Status end() {
    alive_ = false;
    grpc::Status status;
    context_.TryCancel();
    call_->Finish(&status, tag(kFinished));
    for (Event event = await(); event != kFinished; event = await())
      if (event == kSilent) return absl::DeadlineExceededError("the server keeps silent");
    return status.ok() ? absl::DataLossError("the server ended the stream") : failed(status);
  }

  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  std::unique_ptr<Call> call_;
  Response response_;
  std::vector<Slot> slots_;
  std::vector<size_t> free_;
  bool ok_ = false;
  bool alive_ = false;
  bool more_ = false;
  bool writing_ = false;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_STREAM_LOAD_H_
