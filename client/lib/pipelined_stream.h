// Pipelined stream: implementation of UpdateStream and QueryStream. Internal to the library. The stream is a
// bidirectional call with a bounded number of requests in flight. A response carries the sequence number of its
// request. After a broken connection the stream reconnects and sends the unanswered requests again. A connection counts
// as broken if no response arrives for Options::patience while requests are unanswered.
//
// An item may consist of several messages that the server applies as one (UpdateBatch.continues). The server answers
// each of them. The outcome of the item is the answer to the last message, or the error of the first refused message.
// After a broken connection all messages of the item are sent again, since the server has applied none of them.
//
// With Options::renewal, the stream sends a request of its own (Kind::renewal()) when no request that renews the lease
// was sent for that long. Renewals begin with the first such request and end when the stream is closed.
//
// In a cluster, a request that a server refuses because another one leads the scene is not answered: the stream opens a
// call to that server and sends all unanswered requests again.
//
// Threads: each stream owns one thread, the supervisor, which starts one call after another and waits for the end of
// each call. Messages are read and written on gRPC's callback threads. send(), flush() and close() may be called from
// any thread. Callbacks run one at a time, without the lock held.
//
// Invariants: `items_` contains the requests that were accepted and not answered, in the order of sending. Within a
// call, an item is written only after all items before it, and no other message is written between the messages of one
// item. At most one renewal is unanswered. After `ended_` is set, `items_` is and stays empty.
#ifndef LOCUS_CLIENT_LIB_PIPELINED_STREAM_H_
#define LOCUS_CLIENT_LIB_PIPELINED_STREAM_H_

#include <algorithm>
#include <cassert>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "client/lib/authorization.h"
#include "client/lib/connection.h"
#include "client/lib/retry.h"
#include "client/lib/router.h"
#include "client/lib/status.h"
#include "client/lib/writer.h"
#include "core/base/status_macros.h"
#include "grpcpp/channel.h"
#include "grpcpp/client_context.h"
#include "grpcpp/support/client_callback.h"

namespace locus::client {

// Returns whether a new call may succeed after a call ended with `end`.
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
    // Renumbering replaces this request and does not modify it, because a write in progress may still read it.
    std::shared_ptr<Request> request;
    Callback done;             // empty for a renewal
    bool written = false;      // whether the request's write on the current call has begun
    bool sent_before = false;  // whether the write of this request on an earlier call has begun
    // Messages that are written before `request`, and the number of them whose write on the current call has begun.
    std::vector<std::shared_ptr<Request>> held = {};
    size_t held_written = 0;
    absl::Status refusal = {};            // the first error among the answers to `held` on the current call
    std::optional<Reading> reading = {};  // for a query to a cluster
    bool began = false;                   // whether a write of `request` has begun on any call
    bool unapplied = false;               // whether the server of the current call did not apply the request
  };
  using Items = std::deque<Item>;

  // Operations in which update streams and query streams differ. All of them are called with the stream's lock held.
  class Kind {
   public:
    virtual ~Kind() = default;
    // Starts a call to `server`, which outlives it.
    virtual void start_call(const ServerLinks& server, grpc::ClientContext* context, Reactor* reactor) = 0;
    // Returns the view of a request without an update; null for a request with one.
    virtual v1::View* view_of(Request&) { return nullptr; }
    // Returns the revision that a result shows.
    virtual Revision revision_of(const Result& result) const = 0;
    // Assigns, for updates, the writer and batch number of a new request's batch.
    virtual void number(Request& request) = 0;
    // Returns the request that renews the writer's lease.
    virtual Request renewal() { return Request(); }
    // Returns whether a request renews the writer's lease.
    virtual bool renews(const Request&) const { return true; }
    // Returns an error if the response to a message of Item::held shows that the server does not hold the message.
    virtual absl::Status held(Response&) { return absl::OkStatus(); }
    // Converts a response into the outcome of its request.
    virtual absl::StatusOr<Result> outcome_of(Response& response) = 0;
    // Returns whether `item` must be numbered and sent again instead of completing with `outcome`, as must all later
    // items.
    virtual bool goes_again(const Item& item, const absl::StatusOr<Result>& outcome) = 0;
    // Handles the outcome of `item`, which was at index `position` of `items` and has been removed. May change the
    // outcome, and renumber the later items by number_again(). If an error is returned, the stream ends with this
    // error.
    virtual absl::Status answered(const Item& item, absl::StatusOr<Result>& outcome, Items& items, size_t position) = 0;
  };

  struct Options {
    std::shared_ptr<Router> router;
    Lane lane;
    int max_in_flight;
    RetryPolicy reconnect;
    absl::Duration patience;  // maximum time without any response while requests are unanswered
    absl::Duration renewal = absl::InfiniteDuration();  // maximum time without a request that renews the lease
  };

  // Starts the supervisor thread. `kind` must outlive the stream.
  PipelinedStream(Kind& kind, std::string scene, const Options& options)
      : kind_(kind),
        scene_(std::move(scene)),
        max_in_flight_(static_cast<size_t>(std::max(1, options.max_in_flight))),
        patience_(absl::ToChronoNanoseconds(options.patience)),
        backoff_(options.router->reconnection(options.reconnect)),
        router_(options.router),
        lane_(options.lane),
        server_(router_->first()),
        renewal_(absl::ToChronoNanoseconds(options.renewal)),
        supervisor_([this] { supervise(); }) {}

  ~PipelinedStream() {
    {
      std::lock_guard lock(mutex_);
      broken_off_ = true;
      renew_at_ = Clock::time_point::max();
      if (attempt_) attempt_->cancel();
      changed_.notify_all();
    }
    supervisor_.join();
  }

  // Sends the messages of `held`, if any, and then `request`, as one item.
  absl::Status send(Request request, Callback done, std::vector<Request> held = {}) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return ended_ || closing_ || items_.size() < max_in_flight_; });
    if (ended_ || closing_) return why_ended();
    append(std::move(request), std::move(done), std::move(held));
    return absl::OkStatus();
  }

  // Numbers the items from `position` on again, and sends them again. For Kind::answered().
  void number_again(Items& items, size_t position) {
    for (size_t i = position; i < items.size(); ++i) {
      Item& item = items[i];
      // End the messages that the server holds, before others are sent. The server refuses this request, because its
      // number is higher than the number of an item that is sent again.
      if (item.held_written > 0 && !item.written) group_end_ = item.request;
      for (std::shared_ptr<Request>& message : item.held) {
        message = std::make_shared<Request>(*message);
        message->set_sequence(++sequence_);
      }
      item.request = std::make_shared<Request>(*item.request);
      item.request->set_sequence(++sequence_);
      kind_.number(*item.request);
      item.written = item.sent_before = false;
      item.held_written = 0;
      item.refusal = absl::OkStatus();
    }
  }

  absl::Status flush() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return items_.empty() && running_callbacks_ == 0; });
    return ended_.value_or(fatal_);
  }

  absl::Status close() {
    std::unique_lock lock(mutex_);
    closing_ = true;
    renew_at_ = Clock::time_point::max();
    pump();
    changed_.notify_all();
    changed_.wait(lock, [this] { return items_.empty() && running_callbacks_ == 0; });
    if (!changed_.wait_for(lock, kCloseTimeout, [this] { return ended_.has_value(); })) {
      if (attempt_) attempt_->cancel();
      changed_.wait(lock, [this] { return ended_.has_value(); });
    }
    return *ended_;
  }

 private:
  using Clock = std::chrono::steady_clock;

  // Maximum time for which close() waits until the server ends the call. After this time close() cancels the call.
  static constexpr std::chrono::seconds kCloseTimeout{5};
  // Maximum duration of one wait on the condition variable; the caller then waits again. The maximum is needed because
  // the end of the wait would overflow if the patience is unlimited.
  static constexpr std::chrono::hours kLongestWait{1};
  // Maximum number of servers of a cluster that are tried in a row without a wait.
  static constexpr int kMaxHops = 8;

  // One gRPC call. A hold (AddHold) prevents gRPC from finishing the call while other threads may still start writes.
  // OnReadDone() removes the hold when a read fails, which means that the call has ended. The stream's lock guards all
  // members except `response_`, which only the read in progress and OnReadDone() use.
  class Attempt final : public Reactor {
   public:
    explicit Attempt(PipelinedStream& stream)
        : stream_(stream),
          token_(prepare(context_, {.authorization = *stream.server_->authorization, .scene = stream.scene_})) {}

    void start() {
      stream_.kind_.start_call(*stream_.server_, &context_, this);
      this->StartRead(&response_);
      this->AddHold();
      this->StartCall();
    }
    void cancel() { context_.TryCancel(); }

    uint64_t token() const { return token_; }
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
    const uint64_t token_;  // number of the token that the call carries
    Response response_;
    std::shared_ptr<Request> writing_;
    bool broken_ = false;
    bool writes_done_ = false;
    std::optional<absl::Status> end_;
  };

  // Appends an item and starts to write it. Precondition: the caller holds the lock.
  void append(Request request, Callback done, std::vector<Request> held) {
    if (kind_.renews(request)) renew_at_ = time_after(renewal_);
    Item item = {std::make_shared<Request>(std::move(request)), std::move(done)};
    for (Request& message : held) {
      item.held.push_back(std::make_shared<Request>(std::move(message)));
      item.held.back()->set_scene(scene_);
      item.held.back()->set_sequence(++sequence_);
    }
    item.request->set_scene(scene_);
    item.request->set_sequence(++sequence_);
    kind_.number(*item.request);
    if (router_->routes() != nullptr) choose_reading(item);
    if (items_.empty()) last_response_ = Clock::now();
    items_.push_back(std::move(item));
    pump();
    changed_.notify_all();
  }

  // Decides which server of the cluster may answer an item.
  void choose_reading(Item& item) {
    if (const v1::View* const view = kind_.view_of(*item.request)) item.reading = router_->reading(scene_, *view);
    needs_leader_ |= !item.reading || item.reading->leader();
  }

  // Returns the time after `wait`, or the maximum if it would overflow.
  static Clock::time_point time_after(Clock::duration wait) {
    const Clock::time_point now = Clock::now();
    return wait < Clock::time_point::max() - now ? now + wait : Clock::time_point::max();
  }

  // Sends a renewal if it is due and no renewal is unanswered. Precondition: the caller holds the lock.
  void renew_if_due() {
    if (Clock::now() < renew_at_) return;
    renew_at_ = time_after(renewal_);
    const auto is_renewal = [](const Item& item) { return !item.done; };
    if (fatal_.ok() && std::none_of(items_.begin(), items_.end(), is_renewal)) append(kind_.renewal(), {}, {});
  }

  // Starts writing the next unwritten message. If the stream is closing and all requests are answered, ends the writes
  // of the call instead. Does nothing while a write is in progress. Precondition: the caller holds the lock.
  void pump() {
    if (!attempt_ || !attempt_->writable() || !moved_.ok()) return;
    const auto next = std::find_if(items_.begin(), items_.end(), [](const Item& item) { return !item.written; });
    if (group_end_) {
      attempt_->write(std::exchange(group_end_, nullptr));
    } else if (next != items_.end() && next->held_written < next->held.size()) {
      attempt_->write(next->held[next->held_written++]);
    } else if (next != items_.end()) {
      set_view(*next);
      next->written = next->began = true;
      attempt_->write(next->request);
    } else if (closing_ && items_.empty()) {
      attempt_->end_writes();
    }
    assert(check_invariants());
  }

  // Sets the view of a query to a cluster, just before the query is written.
  void set_view(Item& item) {
    if (!item.reading) return;
    if (item.began) item.request = std::make_shared<Request>(*item.request);
    *kind_.view_of(*item.request) = item.reading->next_view();
  }

  // Returns whether the invariants in the file comment hold. O(items). Precondition: the caller holds the lock.
  bool check_invariants() const {
    const auto renewals = std::count_if(items_.begin(), items_.end(), [](const Item& item) { return !item.done; });
    return renewals <= 1 && items_.size() <= max_in_flight_ + static_cast<size_t>(renewals) &&
           (!ended_ || items_.empty()) &&
           std::is_partitioned(items_.begin(), items_.end(), [](const Item& item) { return item.written; });
  }

  // Completes the request that `response` answers. Ignores a response whose sequence number matches no item: its
  // request was renumbered in the meantime and is sent again.
  void receive(Response& response) {
    std::unique_lock lock(mutex_);
    const auto answers = [&](const std::shared_ptr<Request>& request) {
      return request->sequence() == response.sequence();
    };
    const auto item = std::find_if(items_.begin(), items_.end(), [&](const Item& candidate) {
      return answers(candidate.request) || std::any_of(candidate.held.begin(), candidate.held.end(), answers);
    });
    if (item == items_.end()) return;
    if (!answers(item->request)) {  // an answer to a message of `item->held`
      last_response_ = Clock::now();
      return item->refusal.Update(kind_.held(response));
    }
    const size_t position = static_cast<size_t>(item - items_.begin());
    if (!moved_.ok()) return;
    last_response_ = Clock::now();
    absl::StatusOr<Result> outcome = kind_.outcome_of(response);
    if (!item->refusal.ok()) outcome = item->refusal;
    if (router_->routes() != nullptr && !outcome.ok() && moves_to_other_server(outcome.status()))
      return move(position, outcome.status());
    backoff_.reset();
    hops_ = 0;
    if (item->reading && !outcome.ok() && item->reading->turns_to_leader(outcome.status())) return ask_again(position);
    note_revision(*item, outcome);
    if (kind_.goes_again(*item, outcome)) {
      number_again(items_, position);
      return pump();
    }
    Item answered = std::move(*item);
    items_.erase(item);
    fatal_.Update(kind_.answered(answered, outcome, items_, position));
    if (fatal_.ok()) {
      pump();
    } else {
      attempt_->cancel();
    }
    complete(lock, answered.done, std::move(outcome));
  }

  // Ends the call, to continue at another server, since the item at `position` was refused with `failure`.
  void move(size_t position, const absl::Status& failure) {
    moved_ = failure;
    Item& refused = items_[position];
    if (refused.reading && absl::IsFailedPrecondition(failure)) {
      refused.reading->ask_leader();  // a follower that is older than the view admits
      needs_leader_ = true;
    }
    // The server applied neither this update nor a later one, whose number would have left a gap.
    if (!refused.reading && refused_by_server(failure) && !refused.sent_before)
      for (size_t i = position; i < items_.size(); ++i) items_[i].unapplied = true;
    attempt_->cancel();
    changed_.notify_all();
  }

  // Sends the query at `position` again, on the same call.
  void ask_again(size_t position) {
    const auto item = items_.begin() + static_cast<std::ptrdiff_t>(position);
    item->written = false;
    std::rotate(item, item + 1, std::find_if(item + 1, items_.end(), [](const Item& other) { return !other.written; }));
    pump();
  }

  // Notes the revision that a result shows.
  void note_revision(Item& item, const absl::StatusOr<Result>& outcome) {
    if (router_->routes() == nullptr || !outcome.ok()) return;
    const Revision revision = kind_.revision_of(*outcome);
    if (item.reading) return item.reading->answered(revision);
    router_->routes()->saw(scene_, revision, /*from_leader=*/true);
  }

  void complete(std::unique_lock<std::mutex>& lock, Callback& done, absl::StatusOr<Result> outcome) {
    if (!done) return changed_.notify_all();
    ++running_callbacks_;
    changed_.notify_all();
    lock.unlock();
    done(std::move(outcome));
    lock.lock();
    --running_callbacks_;
    changed_.notify_all();
  }

  void supervise() {
    std::unique_lock lock(mutex_);
    while (!ended_) {
      const auto has_work = [this] { return broken_off_ || closing_ || !items_.empty(); };
      while (!has_work()) wait_or_renew(lock, kLongestWait, has_work);
      if (!broken_off_ && !items_.empty()) {
        const absl::Status end = run_attempt(lock);
        if (const std::optional<absl::Duration> wait = wait_before_next(end)) {
          changed_.wait_for(lock, absl::ToChronoNanoseconds(*wait), [this] { return broken_off_; });
          if (broken_off_) continue;
          lock.unlock();
          continue_connecting(server_->link_of(lane_), absl::InfiniteFuture());
          lock.lock();
          continue;
        }
        finish(lock, end);
      } else {
        finish(lock, broken_off_ ? absl::CancelledError("the stream was broken off") : absl::OkStatus());
      }
    }
  }

  absl::Status run_attempt(std::unique_lock<std::mutex>& lock) {
    RETURN_IF_ERROR(choose_server(lock));
    if (broken_off_) return absl::CancelledError("the stream was broken off");
    for (Item& item : items_) {
      const bool unapplied = std::exchange(item.unapplied, false);
      item.sent_before |= std::exchange(item.written, false) && !unapplied;
      item.held_written = 0;
      item.refusal = absl::OkStatus();
    }
    group_end_.reset();
    {
      ASSIGN_OR_RETURN(const CallGate::Permit permit, CallGate::enter(server_->link_of(lane_).gate));
      attempt_ = std::make_unique<Attempt>(*this);
      attempt_->start();
    }
    last_response_ = Clock::now();
    pump();
    const bool silent = !wait_for_end(lock);
    absl::Status end = *attempt_->end();
    const uint64_t token = attempt_->token();
    attempt_.reset();
    RETURN_IF_ERROR(fatal_);
    if (broken_off_) return absl::CancelledError("the stream was broken off");
    if (!moved_.ok()) return std::exchange(moved_, absl::OkStatus());
    if (closing_ && items_.empty()) return absl::OkStatus();
    if (silent) return absl::UnavailableError("the server answered nothing for as long as the stream is patient");
    if (end.ok()) return absl::UnavailableError("the server ended the stream before it had answered everything");
    if (absl::IsUnauthenticated(end) && server_->authorization->has_newer(token)) {
      return absl::UnavailableError(absl::StrCat("the token has changed: ", end.message()));
    }
    return end;
  }

  // Chooses the server of the next call.
  absl::Status choose_server(std::unique_lock<std::mutex>& lock) {
    if (router_->routes() == nullptr) return absl::OkStatus();
    const std::optional<Reading> reading = needs_leader_ ? std::nullopt : router_->reading(scene_, {});
    lock.unlock();
    auto server = router_->server_for(scene_, reading ? &*reading : nullptr);
    lock.lock();
    if (server.ok()) server_ = *std::move(server);
    return server.status();
  }

  // Waits for the end of the current call and returns true. If no response arrives for `patience_` while requests are
  // unanswered, cancels the call, waits for its end and returns false.
  bool wait_for_end(std::unique_lock<std::mutex>& lock) {
    const auto ended = [this] { return attempt_->end().has_value(); };
    while (!ended()) {
      const Clock::duration quiet = items_.empty() ? Clock::duration::zero() : Clock::now() - last_response_;
      if (quiet >= patience_) {
        attempt_->cancel();
        changed_.wait(lock, ended);
        return false;
      }
      wait_or_renew(lock, std::min<Clock::duration>(patience_ - quiet, kLongestWait), ended);
    }
    return true;
  }

  // Waits until `done` is true, a renewal is due, or `wait` has passed. Sends the renewal if it is due.
  template <class Done>
  void wait_or_renew(std::unique_lock<std::mutex>& lock, Clock::duration wait, const Done& done) {
    const Clock::time_point until = std::min(renew_at_, Clock::now() + wait);
    changed_.wait_until(lock, until, [&] { return done() || renew_at_ < until; });
    renew_if_due();
  }

  // Returns the wait before the next call. Returns nothing if the stream must end with `end` instead of opening another
  // call. If the connection is lost while all requests are answered, the loss does not count as a failure.
  std::optional<absl::Duration> wait_before_next(const absl::Status& end) {
    if (broken_off_ || !fatal_.ok() || end.ok()) return std::nullopt;
    const bool in_cluster = router_->routes() != nullptr;
    if (!worth_reconnecting(end) && !(in_cluster && moves_to_other_server(end))) return std::nullopt;
    const bool follow = in_cluster && router_->note(scene_, server_->target, end);
    if (items_.empty()) return absl::ZeroDuration();
    if (follow && hops_ < kMaxHops) {
      ++hops_;
      return absl::ZeroDuration();
    }
    hops_ = 0;
    return backoff_.after_failure(end);
  }

  void finish(std::unique_lock<std::mutex>& lock, const absl::Status& end) {
    ended_ = broken_off_ ? end : router_->gave_up(end);
    Items unanswered = std::exchange(items_, Items());
    assert(check_invariants());
    for (Item& item : unanswered) complete(lock, item.done, end_of(item));
    changed_.notify_all();
  }

  // Returns the error of an unanswered item. The server whose refusal ended the stream of a cluster may not be the one
  // to which an update was sent before.
  absl::Status end_of(const Item& item) const {
    const bool refused = router_->routes() != nullptr && moves_to_other_server(*ended_) && refused_by_server(*ended_);
    return refused && !item.reading && item.began ? outcome_unknown(*ended_) : *ended_;
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
  const std::shared_ptr<Router> router_;
  const Lane lane_;
  std::shared_ptr<const ServerLinks> server_;  // of the current call
  absl::Status moved_;                         // error that moves the stream to another server
  bool needs_leader_ = false;                  // whether updates or queries for the leader were sent
  int hops_ = 0;                               // calls of other servers in a row without a wait
  const Clock::duration renewal_;
  Clock::time_point renew_at_ = Clock::time_point::max();  // time of the next renewal
  uint64_t sequence_ = 0;                                  // of the latest message
  // Message that ends an item of which some messages were written when it was numbered again; null = none.
  std::shared_ptr<Request> group_end_;
  Items items_;
  // Start of the current wait for a response: the time of the last response, of the start of the call, or of the first
  // request after all earlier requests were answered, whichever is latest.
  Clock::time_point last_response_;
  std::unique_ptr<Attempt> attempt_;  // the call in progress
  int running_callbacks_ = 0;         // number of callbacks that have begun and not returned
  bool closing_ = false;
  bool broken_off_ = false;
  absl::Status fatal_;                 // error of Kind::answered(), which ends the stream
  std::optional<absl::Status> ended_;  // set once the stream has ended; OK = closed normally

  std::thread supervisor_;  // declared last: the thread uses all members above
};

// Calls `send` with a callback that sets a future, and returns the future. If `send` itself returns an error, the
// future receives this error.
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
