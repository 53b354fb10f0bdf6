// Functions of Caller that identify the caller, check its rights and quotas, and write audit lines.
#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "locus/rpc_paths.h"
#include "server/rpc/call.h"
#include "server/rpc/peer_identity.h"
#include "server/scheduling/clocks.h"

namespace locus::server {
namespace {

// Returns whether kRpcRights has a row for the rpc. The build fails if a row is missing, because without the row nobody
// could call the rpc.
constexpr bool has_right(std::string_view path) {
  for (const RpcRight& row : kRpcRights)
    if (std::string_view(row.path.data(), row.path.size()) == path) return true;
  return false;
}
static_assert(std::all_of(kRpcPaths.begin(), kRpcPaths.end(), has_right), "add the new rpc to kRpcRights");

constexpr const char* kAuthorization = "authorization";
// A connection is closed after more wrong credentials than this number, because checking one takes up to 0.2 ms.
constexpr uint32_t kMaxWrongCredentials = 32;

// Identity that a connection has proved with a bearer credential. It is stored so that the connection's next call need
// not prove it again.
struct ProvedIdentity {
  std::string bearer;
  uint64_t generation = 0;
  IdentityPtr identity;
};

absl::string_view bearer_of(const grpc::ServerContextBase& context) {
  const auto entry = context.client_metadata().find(kAuthorization);
  if (entry == context.client_metadata().end()) return {};
  return bearer_of_header({entry->second.data(), entry->second.size()});
}

absl::Status no_credentials() {
  return absl::UnauthenticatedError(
      "this server needs credentials: send a token as metadata `authorization: Bearer TOKEN`, or a client certificate");
}

absl::Status lacks(const Identity& identity, Right right, absl::string_view what) {
  return absl::PermissionDeniedError(absl::StrCat(identity.principal, " lacks the right ", right_name(right), what,
                                                  "; ask the operator for a line `grant` in the access file"));
}

// Adds `bytes` to `claimed`, the bytes that all calls of one owner have claimed. `owner` is the kind of the owner, for
// the error: "connection" or "identity". Returns RESOURCE_EXHAUSTED, and adds nothing, if the sum would exceed `share`.
absl::Status take_share(std::atomic<uint64_t>& claimed, absl::string_view owner, uint64_t share,
                        absl::string_view field, uint64_t bytes) {
  constexpr uint32_t kShareRetryMs = 200;
  const uint64_t held = claimed.fetch_add(bytes);
  if (bytes <= share && held <= share - bytes) return absl::OkStatus();
  claimed.fetch_sub(bytes);
  Refusal refusal;
  refusal.reason = Reason::kLimit;
  refusal.field = std::string(field);
  refusal.limit = absl::StrCat(owner, "_memory_bytes");
  refusal.limit_value = static_cast<double>(share);
  refusal.asked = static_cast<double>(held) + static_cast<double>(bytes);
  if (bytes <= share) refusal.retry_after_ms = kShareRetryMs;
  return refuse(absl::StatusCode::kResourceExhausted,
                absl::StrCat("limit ", refusal.limit, " is ", share, ", of which calls of this ", owner, " hold ", held,
                             "; this may need ", bytes,
                             " more. Read the answers, make fewer calls at once, or send smaller batches"),
                refusal);
}

absl::StatusOr<IdentityPtr> authenticate(const AccessControl& access, Connection& connection,
                                         const grpc::ServerContextBase& context) {
  const absl::string_view bearer = bearer_of(context);
  const auto proved = std::static_pointer_cast<const ProvedIdentity>(connection.identity());
  if (proved != nullptr && !bearer.empty() && proved->bearer == bearer && proved->generation == access.generation() &&
      access.still_valid(*proved->identity))
    return proved->identity;
  const std::optional<std::string> certificate = certificate_name(context);
  Credentials credentials;
  credentials.bearer = bearer;
  if (certificate) credentials.certificate_name = *certificate;
  credentials.unix_uid = connection.peer().uid;
  credentials.local = connection.peer().uid.has_value();
  const uint64_t generation = access.generation();
  absl::StatusOr<IdentityPtr> identity = access.authenticate(credentials);
  if (!identity.ok() && connection.wrong_credentials() > kMaxWrongCredentials) connection.close("wrong credentials");
  if (identity.ok() && !bearer.empty())
    connection.set_identity(
        std::make_shared<const ProvedIdentity>(ProvedIdentity{std::string(bearer), generation, *identity}));
  return identity;
}

}  // namespace

absl::Status Caller::check_certificate() const {
  int64_t end = connection_->certificate_end.load(std::memory_order_relaxed);
  if (end == 0) {
    end = std::max<int64_t>(peer_certificate_end(context_), 1);  // an unreadable certificate counts as expired
    connection_->certificate_end.store(end, std::memory_order_relaxed);
  }
  if (end == std::numeric_limits<int64_t>::max() || unix_seconds() < end) return absl::OkStatus();
  connection_->close("its certificate has expired", Misuse::kNo);
  return absl::UnauthenticatedError("the client certificate has expired; connect again with a new one");
}

absl::Status Caller::authorize(absl::string_view path) {
  if (connection_->close_reason() != nullptr) return absl::CancelledError("the connection was closed");
  rpc_right_ = right_of(path);
  RETURN_IF_ERROR(check_certificate());
  if (state_.access == nullptr || !state_.access->enabled()) return absl::OkStatus();
  if (rpc_right_ == nullptr) return lacks(*identity_, Right::kRead, absl::StrCat(" to call ", path));
  quota_subjects_ = quota_subjects();
  if (!needs_right()) return absl::OkStatus();
  ASSIGN_OR_RETURN(identity_, authenticate(*state_.access, *connection_, context_));
  quota_subjects_.front() = identity_->principal;
  if (identity_->kind != IdentityKind::kAnonymous) {
    client_ = std::hash<std::string>{}(identity_->principal);
    identity_share_ = state_.shares.of(identity_->principal);
  }
  return check_grants();
}

bool Caller::needs_right() const { return rpc_right_ != nullptr && rpc_right_->need != Need::kNothing; }

absl::Status Caller::check_grants() const {
  const std::shared_ptr<const AccessRules> rules = state_.access->rules();
  if (!rules->knows(*identity_))
    return identity_->kind == IdentityKind::kAnonymous ? no_credentials() : lacks(*identity_, rpc_right_->right, "");
  if (rpc_right_->need == Need::kServerRight && !rules->allows(*identity_, rpc_right_->right))
    return lacks(*identity_, rpc_right_->right, "");
  return absl::OkStatus();
}

bool Caller::may(Right right, absl::string_view scene) const {
  return state_.access == nullptr || !state_.access->enabled() ||
         state_.access->rules()->allows(*identity_, right, scene);
}

bool Caller::administers_all() const {
  return state_.access == nullptr || !state_.access->enabled() ||
         state_.access->rules()->allows_all(*identity_, Right::kAdmin);
}

absl::Status Caller::check_right(const std::string& scene) const {
  if (rpc_right_ == nullptr || rpc_right_->need != Need::kSceneRight || may(rpc_right_->right, scene)) {
    had_right_.store(true);
    return absl::OkStatus();
  }
  if (!may(Right::kRead, scene)) return no_scene(scene);
  return lacks_right(rpc_right_->right, scene);
}

absl::Status Caller::lacks_right(Right right, absl::string_view scene) const {
  return lacks(*identity_, right, absl::StrCat(" to scene '", scene, "'"));
}

absl::Status Caller::recheck(const std::string& scene) const {
  if (state_.access == nullptr || !state_.access->enabled() || !needs_right()) return absl::OkStatus();
  if (!state_.access->still_valid(*identity_))
    return absl::UnauthenticatedError("the credentials were revoked or have expired; get new ones and call again");
  RETURN_IF_ERROR(check_grants());
  return scene.empty() || !had_right_.load() ? absl::OkStatus() : check_right(scene);
}

bool Caller::has_quotas() const {
  return state_.access != nullptr && state_.access->enabled() && state_.access->rules()->has_quotas();
}

std::array<std::string, 2> Caller::quota_subjects() const {
  return {identity_->principal, absl::StrCat("connection:", connection_->peer().name)};
}

absl::Status Caller::take_quota(QuotaKind kind, double amount) const {
  if (!has_quotas()) return absl::OkStatus();
  return state_.quotas.take_each(quota_subjects_, kind, amount, steady_nanoseconds());
}

void Caller::charge_quota(QuotaKind kind, double amount) const {
  if (!has_quotas()) return;
  const uint64_t now = steady_nanoseconds();
  for (const std::string& subject : quota_subjects_) state_.quotas.charge(subject, kind, amount, now);
}

void Caller::give_back_quota(QuotaKind kind, double amount) const {
  if (!has_quotas()) return;
  for (const std::string& subject : quota_subjects_) state_.quotas.give_back(subject, kind, amount);
}

absl::StatusOr<QuotaHold> Caller::hold_quota(QuotaKind kind, double amount) const {
  if (!has_quotas()) return QuotaHold();
  return state_.quotas.hold(quota_subjects_, kind, amount, steady_nanoseconds());
}

absl::StatusOr<CallMemory> Caller::claim(MemoryLine line, absl::string_view field, uint64_t bytes) const {
  ASSIGN_OR_RETURN(QuotaHold quota, hold_quota(QuotaKind::kBytesInFlight, static_cast<double>(bytes)));
  const bool is_shared = line >= MemoryLine::kMoves;
  if (is_shared) RETURN_IF_ERROR(take_shares(field, bytes));
  absl::StatusOr<MemoryBudget::Claim> claim = state_.memory.claim(line, field, bytes, client());
  if (!is_shared && claim.ok()) return CallMemory(*std::move(claim), std::move(quota), nullptr, nullptr);
  if (claim.ok()) return CallMemory(*std::move(claim), std::move(quota), connection_, identity_share_);
  if (is_shared) connection_->claimed_bytes.fetch_sub(bytes);
  if (is_shared && identity_share_ != nullptr) identity_share_->fetch_sub(bytes);
  return claim.status();
}

absl::Status Caller::take_shares(absl::string_view field, uint64_t bytes) const {
  const uint64_t share = state_.memory.connection_share();
  RETURN_IF_ERROR(take_share(connection_->claimed_bytes, "connection", share, field, bytes));
  if (identity_share_ == nullptr) return absl::OkStatus();
  absl::Status taken = take_share(*identity_share_, "identity", share, field, bytes);
  if (!taken.ok()) connection_->claimed_bytes.fetch_sub(bytes);
  return taken;
}

CallMemory Caller::claim_anyway(MemoryLine line, uint64_t bytes) const {
  QuotaHold quota;
  if (has_quotas())
    quota = state_.quotas.hold_anyway(quota_subjects_, QuotaKind::kBytesInFlight, static_cast<double>(bytes),
                                      steady_nanoseconds());
  return {state_.memory.claim_anyway(line, bytes), std::move(quota), nullptr, nullptr};
}

// Returns true for refusals because of credentials, missing rights or exceeded limits. Also returns true for wrong
// requests, if the call would have changed something. Returns false for all other errors: the call was ended by its
// deadline, by its caller or by the server's shutdown, the server failed, or a name does not exist or is taken.
// audit_hidden() audits calls that name hidden scenes.
bool Caller::is_audited(const absl::Status& status, bool is_change) {
  switch (status.code()) {
    case absl::StatusCode::kUnauthenticated:
    case absl::StatusCode::kPermissionDenied:
    case absl::StatusCode::kResourceExhausted:
      return true;
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kOutOfRange:
    case absl::StatusCode::kAborted:
      return is_change;
    default:
      return false;
  }
}

void Caller::audit_update(const std::string& scene, uint64_t items) const {
  AuditUpdates* const updates = state_.access == nullptr ? nullptr : state_.access->audit_updates();
  if (updates == nullptr || rpc_right_ == nullptr) return;
  updates->count({identity_->principal, connection_->peer().label, rpc_right_->path, scene, items},
                 unix_milliseconds());
}

void Caller::audit_hidden(absl::string_view scene) const {
  const bool said = is_answer_audited_ && subject_ == scene;
  if (!said) audit(scene, absl::NotFoundError("the caller may not read this scene, and cannot know if there is one"));
}

void Caller::audit(absl::string_view subject, const absl::Status& status) const {
  AuditLog* const log = state_.access == nullptr ? nullptr : state_.access->audit();
  if (log == nullptr) return;
  AuditEntry entry;
  entry.unix_ms = unix_milliseconds();
  entry.principal = identity_->principal;
  entry.peer = connection_->peer().label;
  entry.address = connection_->peer().limit_key;
  if (rpc_right_ != nullptr) entry.rpc = std::string(rpc_right_->path);
  entry.subject = std::string(subject);
  entry.code = status.code();
  entry.request_id = trace().request_id;
  entry.text = std::string(status.message());
  log->write(std::move(entry));
}

}  // namespace locus::server
