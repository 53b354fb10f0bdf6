// The state machine of the frequent calls (queries and updates, unary or streams) on a completion queue. A Method names
// the types of a call and starts the work on its messages; HotCall implements the exchange with gRPC for all Methods.
//
// Lifetime: a call belongs to its IO loop and is used only on that loop, so it has no locks. A HotCall first waits for
// a caller. From accepted() on, it lives until three conditions hold: its status was sent (finished_), gRPC has
// reported the end of the call (gone_), and no read, no write and no message is pending. Then the call deletes itself
// at the end of advance(). Work on a message may run on any thread, but calls answered() exactly once, on the IO loop.
// When the caller gives up or the server drains, give_up() asks the work to answer soon. A Slot contains a message, its
// answer and the work on the message. Slots outlive calls and are reused, so that steady traffic allocates no columns.
//
// A stream has at most kSlots messages that are being processed or whose answers wait to be written. If it has kSlots
// such messages, it reads the next message only after an answer has been written, so a caller that does not read its
// answers can use only bounded memory. A call whose answer is not taken within RpcState::stall_limit is cancelled.
// Reads, one write and the work on several messages proceed concurrently. If Method::kInOrder is true, answers are
// written in the order of the messages, otherwise in the order in which the answers become ready.
#ifndef LOCUS_SERVER_RPC_HOT_CALL_H_
#define LOCUS_SERVER_RPC_HOT_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/async_stream.h>
#include <grpcpp/support/async_unary_call.h>
#include <grpcpp/support/byte_buffer.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "server/convert/status.h"
#include "server/rpc/call.h"
#include "server/rpc/call_slot.h"
#include "server/rpc/io_threads.h"
#include "server/rpc/receive.h"
#include "server/rpc/scene_binding.h"

namespace locus::server {

template <class Method>
class HotCall;  // NOLINT(cppcoreguidelines-virtual-class-destructor): a call deletes itself

// Acceptor of the calls of one rpc on one IO loop; keeps some unused slots for reuse. Outlives the loop's calls.
//
// A Method has the types Request, Response and Work, and the constants kRpc, kPath, kStream and kInOrder. Its functions
// are listen(), which requests the next call from gRPC; make_work(), which returns the Work of a CallSlot; begin(),
// which begins the work on a message; and is_change(), which returns whether a message changes its scene. The Method of
// a unary call may have put_error(), which puts an error into the response and returns true, or returns false if the
// error is to be the call's status. The Method of a stream may have a type StreamState: each call has one, which is
// passed to begin(). Such a Method also has continues(), which returns whether the next message belongs to a message,
// and read_continues(), which reads this from the bytes of a message that was not parsed; it returns false if it
// cannot. StreamState::refuse_rest() receives continues() of each message that is refused before begin().
// Work::give_up() asks the work to answer soon if it has not answered yet.
template <class Method>
class Listener {
 public:
  Listener(RpcState& state, const Method& rpc, IoLoop& io) : state_(state), rpc_(rpc), io_(io) {}

  // Requests the first calls from gRPC. Call it once, after the server has started and before the IO threads start.
  void listen() {
    for (int i = 0; i < kWaiting; ++i) HotCall<Method>::listen(*this);
  }

 private:
  friend class HotCall<Method>;
  using Slot = typename HotCall<Method>::Slot;

  static constexpr int kWaiting = 4;         // number of calls that are requested from gRPC and wait for a caller
  static constexpr size_t kSpareSlots = 16;  // maximum number of unused slots kept for later messages

  std::unique_ptr<Slot> take_slot() {
    if (spare_.empty()) return std::make_unique<Slot>(rpc_);
    std::unique_ptr<Slot> slot = std::move(spare_.back());
    spare_.pop_back();
    return slot;
  }
  void give_back(std::unique_ptr<Slot> slot) {
    if (spare_.size() < kSpareSlots && slot->fit_to_keep()) spare_.push_back(std::move(slot));
  }

  RpcState& state_;
  const Method rpc_;
  IoLoop& io_;
  std::vector<std::unique_ptr<Slot>> spare_;
};

// One call of `Method`: waiting to be accepted, or accepted and not yet ended.
template <class Method>
// NOLINTNEXTLINE(cppcoreguidelines-virtual-class-destructor): a call deletes itself
class HotCall final : private IoLoop::ActiveCall {
 public:
  using Request = typename Method::Request;
  using Response = typename Method::Response;

  // A message of a call, from its arrival until its answer is written.
  // NOLINTNEXTLINE(cppcoreguidelines-virtual-class-destructor): only HotCall owns slots
  class Slot final : public CallSlot {
   public:
    explicit Slot(const Method& rpc) : work_(rpc.make_work(*this)) {}

    const Caller& caller() const override { return *call_->caller_; }
    IoLoop& io() const override { return call_->listener_.io_; }
    uint64_t client() const override { return call_->caller_->client(); }
    bool stream() const override { return Method::kStream; }
    absl::Status claim_answer(uint64_t bytes) override {
      ASSIGN_OR_RETURN(answer_claim_, call_->caller_->claim(MemoryLine::kReplies, "", bytes * kAnswerCopies));
      return absl::OkStatus();
    }
    CallMemory take_request_claim() override { return std::move(request_claim_); }
    void hold() override { holds_ = true; }
    void answered(absl::Status status) override { call_->answered(*this, std::move(status)); }

    // Returns whether the slot may be kept for reuse: its messages use at most kMaxKept bytes of memory. Measures the
    // memory only once every kLookEvery bytes of messages, because measuring is slow; in between, returns true.
    bool fit_to_keep() {
      if (bytes_since_look_ < kLookEvery) return true;
      bytes_since_look_ = 0;
      return request_.SpaceUsedLong() + response_.SpaceUsedLong() <= kMaxKept;
    }

   private:
    friend class HotCall;
    static constexpr size_t kLookEvery = 1u << 20;
    static constexpr size_t kMaxKept = 1u << 20;
    // Memory of an answer as a multiple of its encoded size: 2 for the message, whose columns double their capacity as
    // they grow, and 1 for the encoded bytes.
    static constexpr uint64_t kAnswerCopies = 3;

    HotCall* call_ = nullptr;
    Request request_;
    Response response_;
    typename Method::Work work_;
    CallMemory request_claim_;  // memory of the request, claimed until the slot is released
    CallMemory answer_claim_;   // memory of the answer, claimed until it is written
    bool answered_ = false;
    bool holds_ = false;  // the work called hold(): the stream reads no message before this one is answered
    SteadyTime arrived_;
    size_t bytes_since_look_ = 0;
  };

  static void listen(Listener<Method>& listener) {
    HotCall& call = *new HotCall(listener);
    listener.io_.acquire();
    call.context_.AsyncNotifyWhenDone(&call.gone_tag_);
    if constexpr (Method::kStream)
      listener.rpc_.listen(&call.context_, &call.wire_, listener.io_.queue(), &call.accepted_tag_);
    else
      listener.rpc_.listen(&call.context_, &call.incoming_, &call.wire_, listener.io_.queue(), &call.accepted_tag_);
  }

 private:
  using Bytes = grpc::ByteBuffer;
  using Wire = std::conditional_t<Method::kStream, grpc::ServerAsyncReaderWriter<Bytes, Bytes>,
                                  grpc::ServerAsyncResponseWriter<Bytes>>;
  using Tag = MemberTag<HotCall>;
  using Slots = std::vector<std::unique_ptr<Slot>>;
  static constexpr bool kHasState = requires { typename Method::StreamState; };
  struct NoState {};
  template <class M>
  struct StateOf {
    using Type = NoState;
  };
  template <class M>
  requires requires { typename M::StreamState; }
  struct StateOf<M> {
    using Type = typename M::StreamState;
  };

  static constexpr size_t kSlots = 8;
  static constexpr uint32_t kRetryAfterMs = Method::kStream ? 1000 : 100;

  explicit HotCall(Listener<Method>& listener) : listener_(listener) {}
  ~HotCall() {
    if (caller_) caller_->connection().call_ended();
    if (active_call_)
      listener_.io_.leave(*active_call_);
    else
      listener_.io_.release();
  }

  // Handles one event of the call: runs `change`, which changes the state, then advance(). act() nests if work answers
  // immediately; then only the outermost act() runs advance(). May delete the call.
  template <class Change>
  void act(const Change& change) {
    ++acting_;
    change();
    if (--acting_ == 0) advance();
  }

  // Starts every operation that the state now allows, and deletes the call when nothing is pending any more.
  void advance() {
    if (!finishing_) {
      if (stopping_) drop_answers();
      write_next();
      read_next();
      if (no_more_ && writing_ == nullptr && all_done()) finish();
    }
    if (finished_ && gone_ && !reading_ && writing_ == nullptr && slots_.empty()) delete this;
  }

  void accepted(bool ok) {
    if (!ok) {  // the server has ended; gRPC will not deliver gone_tag_
      delete this;
      return;
    }
    listen(listener_);
    active_call_ = listener_.io_.enter(*this);
    arrived_ = std::chrono::steady_clock::now();
    caller_.emplace(listener_.state_, context_, stopped_);
    caller_->count_call();
    act([this] {
      if (absl::Status status = admit(); !status.ok()) {
        refuse(std::move(status));
      } else if (!Method::kStream) {
        no_more_ = true;
        take(incoming_);
      }
    });
  }

  absl::Status admit() {
    RpcState& state = listener_.state_;
    RETURN_IF_ERROR(caller_->authorize(Method::kPath));
    AdmissionLimiter& limiter = Method::kStream ? state.streams : state.calls;
    permit_ = limiter.enter(caller_->client());
    if (!permit_)
      return refuse_full("", Method::kStream ? "streams" : "calls", limiter.max(), limiter.max() + 1.0, kRetryAfterMs);
    RETURN_IF_ERROR(check_serving(state));
    if (Method::kStream) {
      ASSIGN_OR_RETURN(open_quota_, caller_->hold_quota(QuotaKind::kOpenStreams, 1));
      open_.emplace(state.metrics, Method::kRpc);
    }
    return absl::OkStatus();
  }

  void read_next() {
    if constexpr (Method::kStream) {
      if (reading_ || no_more_ || slots_.size() >= kSlots) return;
      if (std::any_of(slots_.begin(), slots_.end(), [](const auto& slot) { return slot->holds_; })) return;
      reading_ = true;
      incoming_.Clear();
      wire_.Read(&incoming_, &read_tag_);
    }
  }

  void read(bool ok) {
    act([this, ok] {
      reading_ = false;
      if (no_more_) return;  // the call already stopped reading: drop this message
      if (!ok) {
        no_more_ = true;
        return;
      }
      Bytes bytes;
      bytes.Swap(&incoming_);
      take(bytes);
    });
  }

  void take(Bytes& bytes) {
    std::unique_ptr<Slot> slot = listener_.take_slot();
    const size_t length = bytes.Valid() ? bytes.Length() : 0;
    caller_->connection().message_read(length);
    slot->bytes_since_look_ += length;
    absl::StatusOr<CallMemory> claim = parse_request(*caller_, wire_plan<Request>(), bytes, slot->request_);
    absl::Status refused = claim.status();
    if (refused.ok()) slot->request_claim_ = *std::move(claim);
    if (!refused.ok() && !can_answer(refused, bytes, slot->request_)) return refuse(std::move(refused));
    if constexpr (Method::kStream)
      if (absl::Status status = scene_.bind(*caller_, slot->request_.scene()); !status.ok())
        return refuse(std::move(status));
    slot->call_ = this;
    slot->answered_ = false;
    slot->arrived_ = std::chrono::steady_clock::now();
    slots_.push_back(std::move(slot));
    begin(*slots_.back(), std::move(refused));
  }

  // Returns whether a message that was refused before it was parsed can be answered on its own, so that its stream
  // continues. The answer needs the message's sequence number, so the numbers and short texts of the message are parsed
  // into `request`.
  static bool can_answer(const absl::Status& refused, const Bytes& bytes, Request& request) {
    const std::optional<Refusal> refusal = refusal_of(refused);
    if (!Method::kStream || !refusal || refusal->reason == Reason::kMalformed) return false;
    if (!parse_envelope(bytes, request)) return false;
    if constexpr (kHasState) return Method::read_continues(bytes, request);
    return true;
  }

  // Begins the work on a message. If `status` is an error, the message was refused already and is answered with it.
  void begin(Slot& slot, absl::Status status) {
    if constexpr (Method::kStream) {
      read_next();  // the next message may arrive while this one is processed
      slot.response_.set_sequence(slot.request_.sequence());
      status.Update(scene_.check(slot.request_.scene()));
      if (!status.ok()) {
        slot.response_.Clear();  // removes the answer of the slot's previous message
        slot.response_.set_sequence(slot.request_.sequence());
        if constexpr (kHasState) state_.refuse_rest(Method::continues(slot.request_));
        return slot.answered(std::move(status));
      }
      if constexpr (kHasState)
        listener_.rpc_.begin(slot.work_, scene_.scene(), slot.request_, slot.response_, state_);
      else
        listener_.rpc_.begin(slot.work_, scene_.scene(), slot.request_, slot.response_);
    } else {
      listener_.rpc_.begin(slot.work_, slot.request_.scene(), slot.request_, slot.response_);
    }
  }

  void answered(Slot& slot, absl::Status status) {
    act([&] {
      LOCUS_CHECK(!slot.answered_);
      slot.answered_ = true;
      slot.holds_ = false;
      record_answer(listener_.state_.metrics, *caller_, Method::kRpc, status, slot.arrived_, scene_of(slot),
                    Method::is_change(slot.request_, slot.response_));
      if (stopping_ || status.ok()) return shrink_claim(slot);
      if constexpr (Method::kStream) {
        if (ends_stream(*caller_, status)) return stop(std::move(status));
        *slot.response_.mutable_error() = to_error(status);
      } else {
        if constexpr (requires { Method::put_error(status, slot.response_); })
          if (!ends_stream(*caller_, status) && Method::put_error(status, slot.response_)) return shrink_claim(slot);
        end(std::move(status));
      }
    });
  }

  // Returns the scene that a message is about. On a stream this is the scene that the first message named; empty if
  // that message was not accepted. For a unary call it is the scene that the request names; empty if the request names
  // none or was not read.
  const std::string& scene_of(const Slot& slot) const {
    return Method::kStream ? scene_.scene() : slot.request_.scene();
  }

  // Reduces the claim for a slot's answer to the memory that the finished answer needs.
  void shrink_claim(Slot& slot) {
    constexpr uint64_t kWorthwhile = 64u << 10;
    if (slot.answer_claim_.bytes() > kWorthwhile)
      slot.answer_claim_.shrink(Slot::kAnswerCopies * slot.response_.ByteSizeLong());
  }

  // Returns whether only the status remains to be sent. A unary call sends its answer together with the status.
  bool all_done() const { return slots_.empty() || (!Method::kStream && slots_.front()->answered_); }

  void write_next() {
    if constexpr (Method::kStream) {
      if (writing_ != nullptr || stopping_) return;
      const auto last = Method::kInOrder && !slots_.empty() ? slots_.begin() + 1 : slots_.end();
      const auto next = std::find_if(slots_.begin(), last, [](const auto& slot) { return slot->answered_; });
      if (next == last) return;
      writing_ = next->get();
      writing_since_ = std::chrono::steady_clock::now();
      serialize(*writing_);
      wire_.Write(outgoing_, &written_tag_);
    }
  }

  void written(bool ok) {
    act([this, ok] {
      release(*std::exchange(writing_, nullptr));
      if (!ok) stop(absl::CancelledError("the caller is gone"));
    });
  }

  void serialize(Slot& slot) {
    outgoing_ = to_bytes(slot.response_);
    slot.bytes_since_look_ += outgoing_.Length();
    caller_->connection().written(outgoing_.Length());
  }

  void release(Slot& slot) {
    const auto position =
        std::find_if(slots_.begin(), slots_.end(), [&](const auto& entry) { return entry.get() == &slot; });
    std::unique_ptr<Slot> owned = std::move(*position);
    slots_.erase(position);
    owned->request_claim_.release();
    owned->answer_claim_.release();
    listener_.give_back(std::move(owned));
  }

  // Ends the call with an error that is not the answer to a message.
  void refuse(absl::Status status) {
    record_answer(listener_.state_.metrics, *caller_, Method::kRpc, status, arrived_, "",
                  Method::is_change(Request::default_instance(), Response::default_instance()));
    end(std::move(status));
  }

  // Stops reading. Messages that were read are still answered; then the call ends with `status`.
  void end(absl::Status status) {
    no_more_ = true;
    end_status_ = std::move(status);
  }

  // Stops reading and drops all answers, because the caller is gone or may no longer make the call, or because the
  // error `status` of a message ends the stream.
  void stop(absl::Status status) {
    if (stopping_) return;
    end(std::move(status));
    stopping_ = true;
    stopped_.store(true);
    give_up();
  }

  void give_up() {
    for (size_t i = 0; i < slots_.size(); ++i)
      if (!slots_[i]->answered_) slots_[i]->work_.give_up();
  }

  void drop_answers() {
    for (size_t i = slots_.size(); i-- > 0;)
      if (slots_[i]->answered_ && slots_[i].get() != writing_) release(*slots_[i]);
  }

  void finish() {
    finishing_ = true;
    writing_since_ = std::chrono::steady_clock::now();
    // Release the permit and the quota first: the caller may call again as soon as it has the answer, and must then be
    // admitted.
    permit_ = AdmissionLimiter::Permit();
    open_quota_.shrink(0);
    // Return the request id of a failed call only, so that the caller can refer to the failure. In successful calls it
    // would only cost bytes.
    if (!end_status_.ok()) context_.AddTrailingMetadata(kRequestIdMetadata, caller_->trace().request_id);
    if constexpr (Method::kStream) {
      wire_.Finish(to_grpc(end_status_), &finished_tag_);
    } else {
      if (end_status_.ok() && !slots_.empty()) {
        serialize(*slots_.front());
        answer_claim_ = std::move(slots_.front()->answer_claim_);
        wire_.Finish(outgoing_, grpc::Status::OK, &finished_tag_);
      } else {
        wire_.FinishWithError(to_grpc(end_status_), &finished_tag_);
      }
      if (!slots_.empty()) release(*slots_.front());
    }
  }

  void finished(bool) {
    act([this] { finished_ = true; });
  }

  // Handles gRPC's report that the call is over. If the report arrives before finish() was called, the caller gave up
  // or the deadline passed.
  void gone(bool) {
    act([this] {
      gone_ = true;
      if (context_.IsCancelled()) caller_->connection().call_cancelled();
      if (!finishing_) stop(absl::CancelledError("the caller gave up"));
    });
  }

  void drain() override {
    act([this] {
      if (Method::kStream && !no_more_) end(draining());
      give_up();
    });
  }

  // Ends the call if its caller has lost the right to make it.
  void recheck() override {
    if (finishing_ || stopping_) return;
    const std::string scene = Method::kStream || slots_.empty() ? scene_.scene() : slots_.front()->request_.scene();
    absl::Status status = caller_->recheck(scene);
    if (status.ok()) return;
    caller_->audit(scene, status);
    act([&] { stop(std::move(status)); });
  }

  // Ends the call if its caller does not read an answer for too long, because unread answers keep their claims of
  // memory.
  void end_if_stalled(SteadyTime now) override {
    const bool is_writing = writing_ != nullptr || (finishing_ && !finished_);
    if (is_writing && now - writing_since_ > listener_.state_.stall_limit) context_.TryCancel();
  }

  Listener<Method>& listener_;
  grpc::ServerContext context_;
  Wire wire_{&context_};
  Bytes incoming_;           // owned by gRPC while reading_
  Bytes outgoing_;           // owned by gRPC while writing_
  CallMemory answer_claim_;  // memory of a unary call's answer while it is sent with the status
  Tag accepted_tag_{*this, &HotCall::accepted};
  Tag read_tag_{*this, &HotCall::read};
  Tag written_tag_{*this, &HotCall::written};
  Tag finished_tag_{*this, &HotCall::finished};
  Tag gone_tag_{*this, &HotCall::gone};

  std::optional<IoLoop::ActiveCalls::iterator> active_call_;
  std::atomic<bool> stopped_{false};  // true once answers are dropped, see stop(); polled by work on any thread
  SteadyTime arrived_;
  std::optional<OpenStream> open_;
  QuotaHold open_quota_;  // hold on the quota open_streams; empty for a unary call
  std::optional<Caller> caller_;
  AdmissionLimiter::Permit permit_;
  SceneBinding scene_;
  [[no_unique_address]] typename StateOf<Method>::Type state_;
  Slots slots_;               // in the order of arrival
  Slot* writing_ = nullptr;   // slot whose answer is being written
  SteadyTime writing_since_;  // start of the last write, or of sending the status
  absl::Status end_status_;   // status that the call ends with
  int acting_ = 0;            // nesting depth of act()
  bool reading_ = false;      // a read is pending
  bool no_more_ = false;      // no further message is accepted
  bool stopping_ = false;     // answers are dropped
  bool finishing_ = false;    // the status is being sent
  bool finished_ = false;     // the status was sent
  bool gone_ = false;         // gRPC has reported the end of the call
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_HOT_CALL_H_
