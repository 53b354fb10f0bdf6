// The machinery under UpdateStream and QueryStream: a bidirectional call whose requests are answered under their
// sequence numbers, with a bounded number under way, that comes back after a broken connection and sends again what was
// not answered; a connection on which nothing is answered for too long counts as broken. Internal to the library.
//
// Threads: one of its own per stream, the supervisor, which opens call after call and waits for each to be over;
// messages move on gRPC's callback threads. send(), flush() and close() may be called from any thread. Answers are
// handed to callbacks one at a time, never with the lock held.
//
// Invariants: `items_` holds what was accepted and not answered, in the order of sending; within a call an item is
// written only after all items before it. After `ended_` is set there are no items, and never will be.
#ifndef LOCUS_CLIENT_LIB_PIPELINED_STREAM_H_
#define LOCUS_CLIENT_LIB_PIPELINED_STREAM_H_

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client/lib/call_metadata.h"
#include "client/lib/retry.h"
#include "client/lib/status.h"
#include "grpcpp/client_context.h"
#include "grpcpp/support/client_callback.h"

namespace locus::client {

// True for an end of a stream after which a new one may do better.
inline bool worth_reconnecting(const absl::Status& end) {
  if (worth_repeating(end)) return true;
  return (absl::IsCancelled(end) || absl::IsInternal(end)) && !refused_by_server(end);
}

template <class Request, class Response, class Result>
class PipelinedStream {
 public:
  using Callback = std::function<void(absl::StatusOr<Result>)>;
  using Reactor = grpc::ClientBidiReactor<Request, Response>;

  struct Item {
    std::shared_ptr<Request> request;  // shared with a write in progress: replace it to change it
    Callback done;
    bool written = false;  // on the current call
  };
  using Items = std::deque<Item>;

  // How one kind of stream differs from another. number() and answered() are called with the stream's lock held.
  class Kind {
   public:
    virtual ~Kind() = default;
    virtual void start_call(grpc::ClientContext* context, Reactor* reactor) = 0;
    // Gives a new request its sequence and other numbers.
    virtual void number(Request& request) = 0;
    virtual absl::StatusOr<Result> outcome_of(Response& response) = 0;
    // Called after the item that stood at `position` was answered and taken out. May renumber those behind it. An error
    // ends the stream.
    virtual absl::Status answered(const absl::StatusOr<Result>& outcome, Items& items, size_t position) = 0;
  };

  struct Options {
    int max_in_flight;
    RetryPolicy reconnect;
    absl::Duration patience;  // with a server that answers nothing
  };

  // `kind` outlives the stream.
  PipelinedStream(Kind& kind, std::string scene, const Options& options)
      : kind_(kind),
        scene_(std::move(scene)),
        max_in_flight_(static_cast<size_t>(std::max(1, options.max_in_flight))),
        patience_(absl::ToChronoNanoseconds(options.patience)),
        backoff_(options.reconnect),
        supervisor_([this] { supervise(); }) {}

  ~PipelinedStream() {
    {
      std::lock_guard lock(mutex_);
      broken_off_ = true;
      if (attempt_) attempt_->cancel();
      changed_.notify_all();
    }
    supervisor_.join();
  }

  absl::Status send(Request request, Callback done) {
    auto shared = std::make_shared<Request>(std::move(request));
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return ended_ || closing_ || items_.size() < max_in_flight_; });
    if (ended_ || closing_) return why_ended();
    shared->set_scene(scene_);
    kind_.number(*shared);
    if (items_.empty()) last_sign_ = Clock::now();
    items_.push_back({std::move(shared), std::move(done)});
    pump();
    changed_.notify_all();
    return absl::OkStatus();
  }

  absl::Status flush() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return items_.empty() && handing_over_ == 0; });
    return ended_.value_or(fatal_);
  }

  absl::Status close() {
    std::unique_lock lock(mutex_);
    closing_ = true;
    pump();
    changed_.notify_all();
    changed_.wait(lock, [this] { return items_.empty() && handing_over_ == 0; });
    if (!changed_.wait_for(lock, kFarewell, [this] { return ended_.has_value(); })) {
      if (attempt_) attempt_->cancel();
      changed_.wait(lock, [this] { return ended_.has_value(); });
    }
    return *ended_;
  }

 private:
  using Clock = std::chrono::steady_clock;

  // How long a server may take to end a stream that was closed.
  static constexpr std::chrono::seconds kFarewell{5};
  // Of a clock's wait, which must not overflow.
  static constexpr std::chrono::hours kLongestWait{1};

  // One call. Its hold keeps gRPC from finishing it while other threads may still start writes; the hold ends with the
  // last read. Members are guarded by the stream's lock, `response_` by the order of reactions.
  class Attempt final : public Reactor {
   public:
    Attempt(PipelinedStream& stream, const std::string& scene) : stream_(stream) { add_scene(context_, scene); }

    void start() {
      stream_.kind_.start_call(&context_, this);
      this->StartRead(&response_);
      this->AddHold();
      this->StartCall();
    }
    void cancel() { context_.TryCancel(); }

    bool writable() const { return !broken_ && !writing_ && !writes_done_; }
    void write(std::shared_ptr<Request> request) {
      writing_ = std::move(request);
      this->StartWrite(writing_.get());
    }
    void end_writes() {
      writes_done_ = true;
      this->StartWritesDone();
    }
    const std::optional<absl::Status>& end() const { return end_; }

    void OnReadDone(bool ok) override {
      if (ok) {
        stream_.receive(response_);
        this->StartRead(&response_);
        return;
      }
      {
        std::lock_guard lock(stream_.mutex_);
        broken_ = true;
      }
      this->RemoveHold();
    }
    void OnWriteDone(bool ok) override {
      std::lock_guard lock(stream_.mutex_);
      writing_.reset();
      if (!ok) broken_ = true;
      stream_.pump();
    }
    void OnDone(const grpc::Status& status) override {
      std::lock_guard lock(stream_.mutex_);
      end_ = to_absl_status(status);
      stream_.changed_.notify_all();
    }

   private:
    PipelinedStream& stream_;
    grpc::ClientContext context_;
    Response response_;
    std::shared_ptr<Request> writing_;
    bool broken_ = false;
    bool writes_done_ = false;
    std::optional<absl::Status> end_;
  };

  // The lock is held. Starts the next write, if one may be started.
  void pump() {
    if (!attempt_ || !attempt_->writable()) return;
    const auto next = std::find_if(items_.begin(), items_.end(), [](const Item& item) { return !item.written; });
    if (next != items_.end()) {
      next->written = true;
      attempt_->write(next->request);
    } else if (closing_ && items_.empty()) {
      attempt_->end_writes();
    }
  }

  // Answers that nobody waits for belong to requests that were renumbered since.
  void receive(Response& response) {
    std::unique_lock lock(mutex_);
    const auto item = std::find_if(items_.begin(), items_.end(), [&](const Item& candidate) {
      return candidate.request->sequence() == response.sequence();
    });
    if (item == items_.end()) return;
    const size_t position = static_cast<size_t>(item - items_.begin());
    Callback done = std::move(item->done);
    items_.erase(item);
    backoff_.reset();
    last_sign_ = Clock::now();
    absl::StatusOr<Result> outcome = kind_.outcome_of(response);
    fatal_.Update(kind_.answered(outcome, items_, position));
    if (fatal_.ok()) {
      pump();
    } else {
      attempt_->cancel();
    }
    hand_over(lock, done, std::move(outcome));
  }

  void hand_over(std::unique_lock<std::mutex>& lock, Callback& done, absl::StatusOr<Result> outcome) {
    ++handing_over_;
    changed_.notify_all();
    lock.unlock();
    done(std::move(outcome));
    lock.lock();
    --handing_over_;
    changed_.notify_all();
  }

  void supervise() {
    std::unique_lock lock(mutex_);
    while (!ended_) {
      changed_.wait(lock, [this] { return broken_off_ || closing_ || !items_.empty(); });
      if (!broken_off_ && !items_.empty()) {
        const absl::Status end = run_attempt(lock);
        if (const std::optional<absl::Duration> wait = wait_before_next(end)) {
          changed_.wait_for(lock, absl::ToChronoNanoseconds(*wait), [this] { return broken_off_; });
          continue;
        }
        finish(lock, end);
      } else {
        finish(lock, broken_off_ ? absl::CancelledError("the stream was broken off") : absl::OkStatus());
      }
    }
  }

  absl::Status run_attempt(std::unique_lock<std::mutex>& lock) {
    for (Item& item : items_) item.written = false;
    attempt_ = std::make_unique<Attempt>(*this, scene_);
    attempt_->start();
    last_sign_ = Clock::now();
    pump();
    const bool silent = !wait_for_end(lock);
    absl::Status end = *attempt_->end();
    attempt_.reset();
    if (!fatal_.ok()) return fatal_;
    if (broken_off_) return absl::CancelledError("the stream was broken off");
    if (closing_ && items_.empty()) return absl::OkStatus();
    if (silent) return absl::UnavailableError("the server answered nothing for as long as the stream is patient");
    if (end.ok()) return absl::UnavailableError("the server ended the stream before it had answered everything");
    return end;
  }

  // False: it was ended here, because the server left everything unanswered for too long.
  bool wait_for_end(std::unique_lock<std::mutex>& lock) {
    const auto ended = [this] { return attempt_->end().has_value(); };
    while (!ended()) {
      const Clock::duration quiet = items_.empty() ? Clock::duration::zero() : Clock::now() - last_sign_;
      if (quiet >= patience_) {
        attempt_->cancel();
        changed_.wait(lock, ended);
        return false;
      }
      changed_.wait_for(lock, std::min<Clock::duration>(patience_ - quiet, kLongestWait), ended);
    }
    return true;
  }

  // Nothing: the stream has ended with `end`. An idle stream may lose its connection as often as it likes.
  std::optional<absl::Duration> wait_before_next(const absl::Status& end) {
    if (broken_off_ || !fatal_.ok() || end.ok() || !worth_reconnecting(end)) return std::nullopt;
    if (items_.empty()) return absl::ZeroDuration();
    return backoff_.after_failure(end);
  }

  void finish(std::unique_lock<std::mutex>& lock, const absl::Status& end) {
    ended_ = end;
    Items unanswered = std::exchange(items_, Items());
    for (Item& item : unanswered) hand_over(lock, item.done, end);
    changed_.notify_all();
  }

  absl::Status why_ended() const {
    if (ended_ && !ended_->ok()) return *ended_;
    return absl::FailedPreconditionError("the stream was closed: open a new one");
  }

  Kind& kind_;
  const std::string scene_;
  const size_t max_in_flight_;
  const Clock::duration patience_;

  std::mutex mutex_;
  std::condition_variable changed_;
  Backoff backoff_;
  Items items_;
  Clock::time_point last_sign_;       // of the server, or since when it is waited for
  std::unique_ptr<Attempt> attempt_;  // the call in progress
  int handing_over_ = 0;              // callbacks running
  bool closing_ = false;
  bool broken_off_ = false;
  absl::Status fatal_;                 // why the kind ended the stream
  std::optional<absl::Status> ended_;  // OK = closed in peace

  std::thread supervisor_;  // last: it uses everything above
};

// Adapts a future to a callback. An error of `send` also goes into the future.
template <class Result, class Send>
std::future<absl::StatusOr<Result>> send_for_future(const Send& send) {
  auto promise = std::make_shared<std::promise<absl::StatusOr<Result>>>();
  std::future<absl::StatusOr<Result>> future = promise->get_future();
  const absl::Status sent = send([promise](absl::StatusOr<Result> outcome) { promise->set_value(std::move(outcome)); });
  if (!sent.ok()) promise->set_value(sent);
  return future;
}

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_PIPELINED_STREAM_H_
