// One call as the services see it: its metadata, its deadline, and whether its caller still waits for an answer.
//
// Threads: while the call lasts, any thread may use a Caller. Exception: authorize(), set_subject(), subject(),
// promise_audit() and audit_hidden() belong to the call's own thread.
#ifndef LOCUS_SERVER_RPC_CALL_H_
#define LOCUS_SERVER_RPC_CALL_H_

#include <grpcpp/server_context.h>

#include <array>
#include <atomic>
#include <chrono>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/connections/connection.h"
#include "server/observability/trace_context.h"
#include "server/rpc/call_memory.h"
#include "server/rpc/rpc_state.h"
#include "server/security/rights.h"

namespace locus::server {

using SteadyTime = std::chrono::steady_clock::time_point;

// Returns the nanoseconds from `start` to now on the steady clock.
uint64_t nanoseconds_since(SteadyTime start);

// The caller's side of one call. Borrows `context`, which must outlive the Caller.
class Caller {
 public:
  // `gone` becomes true when the caller gives up.
  Caller(RpcState& state, const grpc::ServerContextBase& context, const std::atomic<bool>& gone);

  // Returns OK while the call should continue; otherwise CANCELLED, DEADLINE_EXCEEDED, or UNAVAILABLE (DRAINING) when
  // the drain's grace period has passed.
  absl::Status stop() const;

  // Returns the call's deadline; for a call without a deadline, the time a year after the call began.
  SteadyTime deadline() const { return deadline_; }
  // Returns the time until which this call may wait for a revision: its deadline, or limits::kDefaultWaitMs from now if
  // the call has no deadline. For a message of a stream, the time is never later than limits::kDefaultWaitMs from now.
  SteadyTime wait_until(bool stream) const;

  // Returns INVALID_ARGUMENT (MALFORMED) if the metadata `x-scene` names another scene than `scene`.
  absl::Status check_scene(const std::string& scene) const;

  // Counts the call and its metadata for its connection. Call it once, when the call was accepted.
  void count_call() const;

  // Authenticates the caller, and checks the caller's rights to the server (not to scenes) that the method `path`
  // needs. Returns UNAUTHENTICATED if the caller's credentials are not accepted, if the caller's certificate has
  // expired, or if the caller has no credentials and no grant is for callers without credentials. Returns
  // PERMISSION_DENIED if the caller lacks a needed right, and CANCELLED if the connection was closed. Call it before
  // the other functions about rights.
  absl::Status authorize(absl::string_view path);
  // Returns whether the caller has the right. A right to scenes is checked for `scene`; for other rights `scene` is
  // ignored.
  bool may(Right right, absl::string_view scene) const;
  // Returns whether the caller may administer every scene.
  bool administers_all() const;
  // Returns OK if the caller has the right to `scene` that the method needs. Otherwise returns PERMISSION_DENIED if the
  // caller may at least read the scene. If not, returns NOT_FOUND, the error for a scene that does not exist.
  absl::Status check_right(const std::string& scene) const;
  // Returns PERMISSION_DENIED with a text that names the caller, the missing right and the scene.
  absl::Status lacks_right(Right right, absl::string_view scene) const;
  // Returns OK while the caller may continue the call. `scene` is the scene that the call serves; empty if it serves
  // none. Returns UNAUTHENTICATED if the credentials were revoked or have expired since the call began; otherwise the
  // errors of authorize() for the rights that the caller has now, and those of check_right() once it has returned OK. A
  // call whose right to the scene was not checked yet will be refused by that check, with the proper error.
  absl::Status recheck(const std::string& scene) const;
  // Returns the caller's identity. Before authorize(), and in servers without access control, this is the identity of
  // callers without credentials.
  const Identity& identity() const { return *identity_; }

  // Returns an id of the client: a hash of its identity's name or, without an identity, of its connection's name. All
  // calls of a client have the same id; different clients almost certainly have different ids.
  uint64_t client() const { return client_; }

  // Returns the names under which the quotas of the caller's identity and connection are counted.
  std::array<std::string, 2> quota_subjects() const;
  // Takes `amount` from the quotas `kind` of the caller's identity and the caller's connection. See Quotas::take().
  absl::Status take_quota(QuotaKind kind, double amount) const;
  // Takes `amount` from the quotas `kind` of the caller's identity and the caller's connection, even if they do not
  // suffice, because the work is already done.
  void charge_quota(QuotaKind kind, double amount) const;
  // Gives back `amount` that take_quota() took from rates, because the work was not done.
  void give_back_quota(QuotaKind kind, double amount) const;
  // Takes `amount` from the same quotas as take_quota(), but only until the result is destroyed.
  absl::StatusOr<QuotaHold> hold_quota(QuotaKind kind, double amount) const;

  // Claims `bytes` on `line` of the server's memory budget, and takes them from the quota bytes_in_flight of the
  // caller's identity and connection. For the lines of moves, requests and replies, the bytes count against two shares,
  // too: that of the connection and that of the caller's identity (MemoryBudget::connection_share()). If a limit or
  // quota does not suffice, returns RESOURCE_EXHAUSTED, naming the limit or quota.
  absl::StatusOr<CallMemory> claim(MemoryLine line, absl::string_view field, uint64_t bytes) const;
  // Claims `bytes` for work that is never refused, such as work that frees memory, or an answer that is built already.
  CallMemory claim_anyway(MemoryLine line, uint64_t bytes) const;

  // Remembers the scene or mesh that a blocking call is about, for the audit log. Call it on the call's own thread.
  void set_subject(absl::string_view subject) const { subject_ = std::string(subject); }
  const std::string& subject() const { return subject_; }
  // Appends a line about the call to the audit log, if there is an audit log. `subject` is the scene or mesh that the
  // call is about. `status` is OK if the call succeeded; otherwise it says why the call was refused.
  void audit(absl::string_view subject, const absl::Status& status) const;
  // Appends a line to the audit log: the call names `scene`, which the caller may not read and which need not exist.
  // Does nothing if promise_audit() was called and `scene` is the call's subject, because audit() will then append a
  // line that names the scene.
  void audit_hidden(absl::string_view scene) const;
  // Tells audit_hidden() that audit() will be called with the final status of this call.
  void promise_audit() { is_answer_audited_ = true; }
  // Counts an update of a scene for the audit log, to which one line per caller and scene is appended each minute.
  // `items` is the number of objects that the update changed.
  void audit_update(const std::string& scene, uint64_t items) const;
  // Returns whether the refusal `status` is written to the audit log. `is_change` tells whether the refused call would
  // have changed something.
  static bool is_audited(const absl::Status& status, bool is_change);

  // Cancels the call immediately, even while it is blocked in a read or write.
  void cancel() const { context_.TryCancel(); }

  // Returns the ids that name this call in logs: the caller's metadata x-request-id and traceparent if they are valid.
  // Without a valid x-request-id, the request id is generated.
  TraceContext trace() const;

  const RpcState& state() const { return state_; }
  MemoryBudget& memory() const { return state_.memory; }
  // Returns the connection that the call came on.
  Connection& connection() const { return *connection_; }

 private:
  bool has_quotas() const;
  // Returns UNAUTHENTICATED, and closes the connection, if the caller's certificate has expired since the caller
  // connected.
  absl::Status check_certificate() const;
  // Returns whether the method needs a right that must be checked.
  bool needs_right() const;
  // Adds `bytes` to the claims of the connection and to the claims of the identity. Returns RESOURCE_EXHAUSTED, and
  // adds nothing, if the claims of either would exceed its share.
  absl::Status take_shares(absl::string_view field, uint64_t bytes) const;
  // Checks the rights that do not depend on a scene.
  absl::Status check_grants() const;

  RpcState& state_;
  const grpc::ServerContextBase& context_;
  const std::atomic<bool>& gone_;
  const std::shared_ptr<Connection> connection_;
  SteadyTime deadline_;
  const RpcRight* rpc_right_ = nullptr;  // entry of the method in the table of rights; null before authorize()
  IdentityPtr identity_ = anonymous_identity();
  uint64_t client_;                                        // result of client()
  std::shared_ptr<ClientShares::Counter> identity_share_;  // claims of the identity; null without an identity
  std::array<std::string, 2> quota_subjects_;  // result of quota_subjects(); set by authorize() with access control
  mutable std::string subject_;
  mutable std::atomic<bool> had_right_{false};  // check_right() has returned OK
  bool is_answer_audited_ = false;
  const uint64_t number_ = next_request_number();
};

// Metadata key of the request id, in the caller's metadata and in the trailing metadata of the reply.
inline constexpr const char* kRequestIdMetadata = "x-request-id";

// Returns UNAVAILABLE while the server recovers its scenes from the disk, or drains.
absl::Status check_serving(const RpcState& state);

// Returns whether `status`, the error of one message, must end the whole stream. This is the case if the caller ended
// the call, if the call's deadline passed, or if the error is UNAVAILABLE (the server drains or its disk fails). It is
// not the case if the error is DEADLINE_EXCEEDED because the server drains: then the messages are still answered.
bool ends_stream(const Caller& caller, const absl::Status& status);

// Counts a call, or one message of a stream, that was answered with `status`. If `status` is not OK, logs a line at
// debug level. For queries and updates, also writes a line to the audit log if Caller::is_audited() returns true.
// `is_change` tells whether an error refused a change of the scene. `scene` is the scene that the message names; empty
// if it is not known.
void record_answer(CallMetrics& metrics, const Caller& caller, Rpc rpc, const absl::Status& status, SteadyTime arrived,
                   absl::string_view scene = "", bool is_change = false);

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_CALL_H_
