#include "server/security/access_control.h"

#include <pwd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/base/planted_bug.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "server/security/jwt.h"
#include "server/security/security_limits.h"
#include "server/security/text_file.h"
#include "server/security/token_file.h"

namespace locus::server {
namespace {

constexpr size_t kMaxCachedUsers = 1024;
constexpr size_t kPasswdBytes = 16384;  // buffer of getpwuid_r(); enough for a user's line of passwd
constexpr absl::string_view kTokenPrincipal = "token:";
constexpr absl::string_view kBearerPrefix = "Bearer ";

absl::Status check_options(const SecurityOptions& options) {
  if (options.jwks_file.empty() && !(options.jwt_audience.empty() && options.jwt_issuer.empty()))
    return refuse_argument(Reason::kMalformed, "jwks_file", {}, "must be set with jwt_audience or jwt_issuer");
  if (!options.audit_file.empty() && options.audit_bytes < kMinAuditBytes)
    return refuse_argument(Reason::kOutOfRange, "audit_bytes", {}, absl::StrCat("must be at least ", kMinAuditBytes));
  return absl::OkStatus();
}

// Returns the name of a user; the user's number if the user has no name, or has a name of digits only, which could be
// mistaken for another user's number.
std::string user_name(uint32_t uid) {
  std::string buffer(kPasswdBytes, '\0');
  passwd entry;
  passwd* found = nullptr;
  int error;
  do {
    error = ::getpwuid_r(uid, &entry, buffer.data(), buffer.size(), &found);
  } while (error == EINTR);
  const absl::string_view name = error == 0 && found != nullptr ? found->pw_name : "";
  const bool number = std::all_of(name.begin(), name.end(), [](char c) { return absl::ascii_isdigit(c); });
  return number ? absl::StrCat(uid) : std::string(name);
}

absl::StatusOr<IdentityPtr> named_identity(IdentityKind kind, absl::string_view name) {
  auto identity = std::make_shared<Identity>();
  identity->kind = kind;
  const absl::StatusOr<std::string> principal = principal_of(kind, name);
  if (!principal.ok()) return absl::UnauthenticatedError(principal.status().message());
  identity->principal = *principal;
  return identity;
}

IdentityPtr token_identity(const TokenEntry& entry) {
  auto identity = std::make_shared<Identity>();
  identity->kind = IdentityKind::kToken;
  identity->principal = absl::StrCat(kTokenPrincipal, entry.id);
  identity->expires = entry.expires;
  identity->credential.assign(reinterpret_cast<const char*>(entry.hash.data()), entry.hash.size());
  return identity;
}

}  // namespace

absl::string_view bearer_of_header(absl::string_view value) {
  return absl::StartsWithIgnoreCase(value, kBearerPrefix) ? value.substr(kBearerPrefix.size()) : value;
}

struct AccessControl::State {
  AccessRules rules;
  TokenTable tokens;
  std::vector<IdentityPtr> token_identities;  // in the order of tokens.entries()
  std::optional<JwtVerifier> jwt;
  std::vector<std::string> warnings;
};

AccessControl::AccessControl(const SecurityOptions& options, Clock clock)
    : options_(options),
      clock_(std::move(clock)),
      enabled_(!(options.access_file.empty() && options.token_file.empty() && options.jwks_file.empty())) {}

AccessControl::~AccessControl() = default;

absl::StatusOr<std::unique_ptr<AccessControl>> AccessControl::open(const SecurityOptions& options, Clock clock) {
  RETURN_IF_ERROR(check_options(options));
  std::unique_ptr<AccessControl> control(new AccessControl(options, std::move(clock)));
  ASSIGN_OR_RETURN(std::shared_ptr<const State> state, control->read());
  control->publish(std::move(state));
  if (!options.audit_file.empty()) {
    ASSIGN_OR_RETURN(control->audit_, AuditLog::open(options.audit_file, options.audit_bytes));
    control->audit_updates_ = std::make_unique<AuditUpdates>(*control->audit_);
  }
  return control;
}

absl::StatusOr<std::shared_ptr<const AccessControl::State>> AccessControl::read() const {
  auto state = std::make_shared<State>();
  if (!options_.access_file.empty()) {
    ASSIGN_OR_RETURN(const TextFile file, read_text_file(options_.access_file));
    ASSIGN_OR_RETURN(state->rules, AccessRules::parse(options_.access_file, file.text));
  } else {
    state->rules = enabled_ ? AccessRules::verified_allowed() : AccessRules::all_allowed();
  }
  if (!options_.token_file.empty()) {
    ASSIGN_OR_RETURN(state->tokens, TokenTable::read(options_.token_file, state->warnings));
    for (const TokenEntry& entry : state->tokens.entries()) state->token_identities.push_back(token_identity(entry));
  }
  if (!options_.jwks_file.empty()) {
    ASSIGN_OR_RETURN(const TextFile file, read_text_file(options_.jwks_file));
    ASSIGN_OR_RETURN(state->jwt, JwtVerifier::parse(options_.jwks_file, file.text, options_.jwt_audience,
                                                    options_.jwt_issuer, state->warnings));
  }
  return state;
}

void AccessControl::publish(std::shared_ptr<const State> state) {
  MutexLock lock(mutex_);
  state_.swap(state);  // the old state is freed after the lock is released, by the caller or its last reader
}

std::shared_ptr<const AccessControl::State> AccessControl::state() const {
  MutexLock lock(mutex_);
  return state_;
}

std::shared_ptr<const AccessRules> AccessControl::rules() const {
  MutexLock lock(mutex_);
  return {state_, &state_->rules};
}

absl::StatusOr<IdentityPtr> AccessControl::authenticate(const Credentials& credentials) const {
  if (!enabled_) return anonymous_identity();
  if (!credentials.bearer.empty()) return check_bearer(credentials.bearer);
  if (!credentials.certificate_name.empty())
    return named_identity(IdentityKind::kCertificate, credentials.certificate_name);
  if (credentials.unix_uid && (credentials.local || planted(PlantedBug::kUserFromAfar)))
    return user(*credentials.unix_uid);
  return anonymous_identity();
}

absl::StatusOr<IdentityPtr> AccessControl::check_bearer(absl::string_view bearer) const {
  const std::shared_ptr<const State> state = this->state();
  const int64_t now = clock_();
  if (!is_token(bearer) && state->jwt) return state->jwt->verify(bearer, now);
  const TokenEntry* const entry = state->tokens.find(bearer, now);
  if (entry == nullptr) return absl::UnauthenticatedError("the token is not accepted: it is wrong, expired or revoked");
  return state->token_identities[static_cast<size_t>(entry - state->tokens.entries().data())];
}

absl::StatusOr<IdentityPtr> AccessControl::user(uint32_t uid) const {
  {
    MutexLock lock(users_mutex_);
    const auto found = users_.find(uid);
    if (found != users_.end()) return found->second;
  }
  ASSIGN_OR_RETURN(IdentityPtr identity, named_identity(IdentityKind::kUser, user_name(uid)));
  MutexLock lock(users_mutex_);
  if (users_.size() >= kMaxCachedUsers) users_.clear();
  users_[uid] = identity;
  return identity;
}

bool AccessControl::still_valid(const Identity& identity) const {
  switch (identity.kind) {
    case IdentityKind::kAnonymous:
    case IdentityKind::kCertificate:
    case IdentityKind::kUser:
      return true;
    case IdentityKind::kToken:
      if (planted(PlantedBug::kRevokedTokenStays)) return true;
      return state()->tokens.contains(absl::StripPrefix(identity.principal, kTokenPrincipal), identity.credential,
                                      clock_());
    case IdentityKind::kJwt: {
      const std::shared_ptr<const State> state = this->state();
      return state->jwt && state->jwt->has_key(identity.credential) && identity.expires && clock_() < *identity.expires;
    }
  }
  return false;
}

absl::Status AccessControl::reload() {
  MutexLock lock(reload_mutex_);
  if (audit_ != nullptr) audit_->reopen();
  ASSIGN_OR_RETURN(std::shared_ptr<const State> state, read());
  publish(std::move(state));
  {
    MutexLock users_lock(users_mutex_);
    users_.clear();
  }
  if (!planted(PlantedBug::kReloadUnnoticed)) generation_.fetch_add(1, std::memory_order_release);
  for (const std::function<void()>& listener : listeners_) listener();
  return absl::OkStatus();
}

void AccessControl::on_change(std::function<void()> listener) {
  MutexLock lock(reload_mutex_);
  listeners_.push_back(std::move(listener));
}

std::vector<std::string> AccessControl::files() const {
  std::vector<std::string> files;
  for (const std::string& file : {options_.access_file, options_.token_file, options_.jwks_file})
    if (!file.empty()) files.push_back(file);
  return files;
}

std::vector<std::string> AccessControl::warnings() const { return state()->warnings; }

}  // namespace locus::server
