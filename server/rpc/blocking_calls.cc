#include "server/rpc/blocking_calls.h"

#include <google/protobuf/descriptor.h>

#include <atomic>
#include <chrono>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/mutex.h"
#include "server/convert/status.h"
#include "server/observability/log.h"
#include "server/rpc/receive.h"
#include "server/scheduling/semaphore.h"

namespace locus::server {
namespace {

constexpr int kCallsRequested = 4;  // number of calls that are requested from gRPC for each loop and wait for a caller
constexpr uint32_t kCallRetryMs = 100;

absl::Status no_method(const std::string& path) {
  Refusal refusal;
  refusal.reason = Reason::kNotServed;
  return refuse(absl::StatusCode::kUnimplemented, absl::StrCat("this server has no method ", path), refusal);
}

}  // namespace

// One call that was requested from gRPC, or was accepted and is not over yet. Its events arrive on its IO loop. The
// call reads its first message on the loop and is admitted only when this read has ended, so a call that still waits
// for its first message holds no thread and no permit. The method's body then runs on a thread of its own, starts one
// operation at a time and waits for the operation's event. The call deletes itself on the loop when the first read has
// ended, the status was sent (finished_) and gRPC has reported the end of the call (over_).
// NOLINTNEXTLINE(cppcoreguidelines-virtual-class-destructor): a call deletes itself
class BlockingCalls::Call final : private IoLoop::ActiveCall, private MessageStream {
 public:
  static void listen(BlockingCalls& owner, IoLoop& io) {
    Call& call = *new Call(owner, io);
    io.acquire();
    call.context_.AsyncNotifyWhenDone(&call.over_tag_);
    owner.service_.RequestCall(&call.context_, &call.wire_, io.queue(), io.queue(), &call.accepted_tag_);
  }

 private:
  using Tag = MemberTag<Call>;

  Call(BlockingCalls& owner, IoLoop& io) : owner_(owner), io_(io) {}
  ~Call() override {
    if (caller_) caller_->connection().call_ended();
    if (active_call_)
      io_.leave(*active_call_);
    else
      io_.release();
  }

  void accepted(bool ok) {
    if (!ok) {  // the server has ended; gRPC will not deliver over_tag_
      delete this;
      return;
    }
    listen(owner_, io_);
    active_call_ = io_.enter(*this);
    arrived_ = std::chrono::steady_clock::now();
    caller_.emplace(owner_.state_, context_, gone_);
    caller_->count_call();
    if (absl::Status status = check(); !status.ok()) return finish(status);
    first_ = First::kReading;
    wire_.Read(&first_bytes_, &first_read_tag_);
  }

  // Handles the arrival of the first message. `ok` is false if the caller sends no message or gave up.
  void first_read(bool ok) {
    if (ok) caller_->connection().message_read(first_bytes_.Valid() ? first_bytes_.Length() : 0);
    if (first_ == First::kGivenUp) {
      first_ = First::kTaken;
      first_bytes_.Clear();
      return delete_if_ended();
    }
    first_ = ok ? First::kArrived : First::kTaken;
    if (over_) return refuse_first(absl::CancelledError("the caller gave up"));
    if (absl::Status status = admit(); !status.ok()) return refuse_first(status);
    if (!owner_.threads_.run([this] { run(); })) refuse_first(refuse_busy("calls", owner_.threads_.max()));
  }

  // Sends the refusal of a call whose first message has arrived. Frees the message, because its memory is not claimed.
  void refuse_first(const absl::Status& status) {
    first_bytes_.Clear();
    finish(status);
  }

  static absl::Status refuse_busy(const char* limit, uint32_t max) {
    return refuse_full("", limit, max, max + 1.0, kCallRetryMs);
  }

  // Makes the checks that need no message: the method, the caller's rights, and whether the server serves.
  absl::Status check() {
    method_ = owner_.find(context_.method());
    if (method_ == nullptr) return no_method(context_.method());
    if (method_->is_change) caller_->promise_audit();
    RETURN_IF_ERROR(caller_->authorize(method_->path));
    return check_open();
  }

  absl::Status check_open() const {
    return method_->while_closed == WhileClosed::kRefuse ? check_serving(owner_.state_) : absl::OkStatus();
  }

  absl::Status admit() {
    AdmissionLimiter& limiter = method_->limiter == nullptr ? owner_.state_.calls : *method_->limiter;
    permit_ = limiter.enter(caller_->client());
    if (!permit_) return refuse_busy(method_->limit, limiter.max());
    RETURN_IF_ERROR(check_open());
    ASSIGN_OR_RETURN(reply_claim_, caller_->claim(MemoryLine::kReplies, "", method_->reply_bytes));
    return absl::OkStatus();
  }

  // Runs the body on the call's thread. The call may be deleted before run() returns.
  void run() {
    const LogScope scope(caller_->trace());
    finish(method_->body(*caller_, *this));
  }

  // Sends the status. The call may be deleted before finish() returns.
  void finish(const absl::Status& status) {
    context_.AddTrailingMetadata(kRequestIdMetadata, caller_->trace().request_id);
    if (method_ != nullptr && (method_->is_change || Caller::is_audited(status, false)))
      caller_->audit(caller_->subject(), status);
    if (method_ != nullptr && method_->rpc)
      record_answer(owner_.state_.metrics, *caller_, *method_->rpc, status, arrived_);
    // Release the permit first: the caller may call again as soon as it has the answer, and must then be admitted.
    permit_ = AdmissionLimiter::Permit();
    request_claim_.release();
    finishing_since_.store(std::chrono::steady_clock::now());
    if (status.ok() && answer_.Valid())
      wire_.WriteAndFinish(answer_, grpc::WriteOptions(), grpc::Status::OK, &finished_tag_);
    else
      wire_.Finish(to_grpc(status), &finished_tag_);
  }

  absl::StatusOr<bool> read_planned(const WirePlan& plan, google::protobuf::Message& request) override {
    request.Clear();
    request_claim_.release();
    grpc::ByteBuffer bytes;
    if (first_ == First::kArrived) {
      first_ = First::kTaken;
      bytes.Swap(&first_bytes_);
    } else {
      wire_.Read(&bytes, &operation_tag_);
      if (!wait()) return false;
      caller_->connection().message_read(bytes.Valid() ? bytes.Length() : 0);
    }
    ASSIGN_OR_RETURN(request_claim_, parse_request(*caller_, plan, bytes, request));
    remember_scene(request);
    return true;
  }

  bool write(const google::protobuf::Message& response) override {
    const grpc::ByteBuffer bytes = to_bytes(response);
    caller_->connection().written(bytes.Length());
    wire_.Write(bytes, &operation_tag_);
    return wait();
  }

  // Sets the answer and claims its memory. The claim is a member of the call, because the answer may still wait to be
  // sent after the body and the body's claims have ended.
  void answer(const google::protobuf::Message& response) override {
    answer_ = to_bytes(response);
    caller_->connection().written(answer_.Length());
    reply_claim_ = caller_->claim_anyway(MemoryLine::kReplies, answer_.Length());
  }

  // Waits for the end of the running operation. Cancels the call if that takes longer than RpcState::stall_limit.
  bool wait() {
    if (!operated_.wait_for(owner_.state_.stall_limit)) {
      context_.TryCancel();
      operated_.wait();
    }
    return operation_ok_;
  }

  void operated(bool ok) {
    operation_ok_ = ok;
    operated_.post();
  }
  void finished(bool) {
    finished_ = true;
    delete_if_ended();
  }
  // Handles gRPC's report that the call is over: its status was sent, or the caller gave up.
  void over(bool) {
    over_ = true;
    gone_.store(true);
    if (context_.IsCancelled()) caller_->connection().call_cancelled();
    delete_if_ended();
  }
  void delete_if_ended() {
    if (finished_ && over_ && first_ != First::kReading && first_ != First::kGivenUp) delete this;
  }

  // Ends the call if its caller has lost the right to make it.
  void recheck() override {
    if (is_revoked_ || finishing_since_.load() != SteadyTime()) return;
    const std::string scene = this->scene();
    const absl::Status status = caller_->recheck(scene);
    if (status.ok()) return;
    is_revoked_ = true;
    if (first_ == First::kReading) return give_up(status);  // finish() writes the audit line
    caller_->audit(scene, status);
    context_.TryCancel();
  }
  // Does nothing: the body polls Caller::stop(), which fails once the drain's grace period has passed.
  void drain() override {}

  // Ends the call if its caller does not send the first message or does not read the answer.
  void end_if_stalled(SteadyTime now) override {
    const std::chrono::milliseconds limit = owner_.state_.stall_limit;
    if (first_ == First::kReading && now - arrived_ > limit)
      return give_up(absl::DeadlineExceededError(absl::StrCat("no message came within ", limit.count(), " ms")));
    const SteadyTime finishing_since = finishing_since_.load();
    if (finishing_since != SteadyTime() && now - finishing_since > limit) context_.TryCancel();
  }

  // Ends a call whose first message has not arrived yet.
  void give_up(const absl::Status& status) {
    first_ = First::kGivenUp;
    finish(status);
  }

  // Stores the name of the scene that a request is about, if it names one.
  void remember_scene(const google::protobuf::Message& request) {
    const RpcRight* const right = right_of(method_->path);
    const SceneField place = right == nullptr ? SceneField::kNone : right->scene;
    if (place != SceneField::kScene && place != SceneField::kName) return;
    const char* const name = place == SceneField::kScene ? "scene" : "name";
    const google::protobuf::FieldDescriptor* const field = request.GetDescriptor()->FindFieldByName(name);
    LOCUS_CHECK(field != nullptr);
    const MutexLock lock(scene_mutex_);
    scene_ = request.GetReflection()->GetString(request, field);
  }
  std::string scene() const {
    const MutexLock lock(scene_mutex_);
    return scene_;
  }

  // State of the first message.
  enum class First : uint8_t {
    kReading,  // the read is pending, and the call is used on the IO loop only
    kGivenUp,  // the read is pending, but the call is being finished
    kArrived,  // first_bytes_ has the message
    kTaken,    // the body has read the message, or there is no message
  };

  BlockingCalls& owner_;
  IoLoop& io_;
  grpc::GenericServerContext context_;
  grpc::GenericServerAsyncReaderWriter wire_{&context_};
  Tag accepted_tag_{*this, &Call::accepted};
  Tag first_read_tag_{*this, &Call::first_read};
  Tag operation_tag_{*this, &Call::operated};
  Tag finished_tag_{*this, &Call::finished};
  Tag over_tag_{*this, &Call::over};

  std::optional<IoLoop::ActiveCalls::iterator> active_call_;
  const BlockingMethod* method_ = nullptr;
  SteadyTime arrived_;
  std::optional<Caller> caller_;
  AdmissionLimiter::Permit permit_;
  CallMemory reply_claim_;
  CallMemory request_claim_;
  std::atomic<First> first_{First::kTaken};
  grpc::ByteBuffer first_bytes_;                           // owned by gRPC while the first message is read
  grpc::ByteBuffer answer_;                                // set by answer()
  std::atomic<SteadyTime> finishing_since_{SteadyTime()};  // time at which finish() was called; SteadyTime() before
  std::atomic<bool> gone_{false};                          // the caller no longer waits
  Semaphore operated_;                                     // posted when the running read or write has ended
  bool operation_ok_ = false;  // result of the last operation; written before operated_ is posted
  mutable Mutex scene_mutex_;
  std::string scene_ LOCUS_GUARDED_BY(scene_mutex_);
  bool is_revoked_ = false;  // recheck() has ended the call
  bool finished_ = false;    // the status was sent
  bool over_ = false;        // gRPC has reported the end of the call
};

void BlockingCalls::add(const BlockingMethod& method) {
  const bool added = methods_.emplace(method.path, method).second;
  LOCUS_CHECK(added);
}

void BlockingCalls::add(const std::vector<BlockingMethod>& methods) {
  for (const BlockingMethod& method : methods) add(method);
}

const BlockingMethod* BlockingCalls::find(const std::string& path) const {
  const auto method = methods_.find(path);
  return method == methods_.end() ? nullptr : &method->second;
}

void BlockingCalls::listen(IoThreads& threads) {
  for (size_t i = 0; i < threads.loops(); ++i)
    for (int k = 0; k < kCallsRequested; ++k) Call::listen(*this, threads.loop(i));
}

}  // namespace locus::server
