// Access control: reads the security files, identifies callers and publishes the rules that define their rights.
//
// Threads: every member may be called from any thread. Readers never wait for a reload: it prepares a new state, then
// swaps one pointer. If any file has a mistake, a reload publishes nothing and the old state stays in use. The
// generation grows by one with each reload that publishes a state.
#ifndef LOCUS_SERVER_SECURITY_ACCESS_CONTROL_H_
#define LOCUS_SERVER_SECURITY_ACCESS_CONTROL_H_

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/base/mutex.h"
#include "server/security/access_file.h"
#include "server/security/audit_log.h"
#include "server/security/audit_updates.h"
#include "server/security/identity.h"
#include "server/security/security_options.h"

namespace locus::server {

// Credentials of one call, which prove the caller's identity. authenticate() borrows the views.
struct Credentials {
  absl::string_view bearer;            // see bearer_of_header(); empty = none
  absl::string_view certificate_name;  // of the verified client certificate: first URI SAN, else first DNS SAN, else CN
  std::optional<uint32_t> unix_uid;    // user id of the peer of a unix socket; ignored unless `local`
  bool local = false;                  // whether the peer is on this machine
};

// Returns the bearer credential in `value`, the value of a header `authorization`. The prefix `Bearer ` is optional and
// is removed.
absl::string_view bearer_of_header(absl::string_view value);

class AccessControl {
 public:
  // Function that returns the seconds since 1970. Called from any thread.
  using Clock = std::function<int64_t()>;

  // Reads all files. Returns INVALID_ARGUMENT for a mistake in an option or a file, and the error of a file that cannot
  // be read.
  static absl::StatusOr<std::unique_ptr<AccessControl>> open(const SecurityOptions& options, Clock clock);
  ~AccessControl();
  AccessControl(const AccessControl&) = delete;
  AccessControl& operator=(const AccessControl&) = delete;

  // Returns whether access control is on; if it is off, every caller is `anonymous` and may do everything.
  bool enabled() const { return enabled_; }

  // Returns the identity that the credentials prove. A bearer credential takes precedence over a certificate, and a
  // certificate over a user; without credentials the identity is `anonymous`. Returns UNAUTHENTICATED for a bearer
  // token or JWT that is not accepted, with a text that does not say whether the token's id exists.
  absl::StatusOr<IdentityPtr> authenticate(const Credentials& credentials) const;

  // Returns the current rules. Takes less than 50 ns. Use the result for one decision only, because it does not change
  // when the rules change.
  std::shared_ptr<const AccessRules> rules() const;
  // Returns a number that grows with each successful reload(). Code that caches an identity for later calls also stores
  // this number, read before authenticate(), and authenticates again once generation() returns another number.
  uint64_t generation() const { return generation_.load(std::memory_order_acquire); }
  // Returns whether the credentials behind an identity are still valid. A token is valid until it is revoked, replaced
  // or expired; a JWT until it expires or its key is removed from the file; other credentials always.
  bool still_valid(const Identity& identity) const;

  // Reads all files again, and opens the audit file anew. If any file has a mistake, keeps the old state and returns
  // the error. Otherwise publishes the new state, then calls the functions of on_change(). One reload runs at a time.
  absl::Status reload();
  // Adds a function that reload() calls, on its thread, after it has published a state. The function must not call
  // reload() or on_change().
  void on_change(std::function<void()> listener);

  // Returns the files to watch (see file_watcher.h).
  std::vector<std::string> files() const;
  // Returns the warnings about the files in use, one sentence each, for example that other users can read a token file.
  std::vector<std::string> warnings() const;
  // Returns the audit log; nullptr if there is none.
  AuditLog* audit() const { return audit_.get(); }
  // Returns the counts of updates for the audit log; nullptr if there is no audit log.
  AuditUpdates* audit_updates() const { return audit_updates_.get(); }

 private:
  struct State;  // rules, tokens and keys from one reading of the files

  AccessControl(const SecurityOptions& options, Clock clock);
  absl::StatusOr<std::shared_ptr<const State>> read() const;
  void publish(std::shared_ptr<const State> state) LOCUS_EXCLUDES(mutex_);
  std::shared_ptr<const State> state() const LOCUS_EXCLUDES(mutex_);
  absl::StatusOr<IdentityPtr> check_bearer(absl::string_view bearer) const;
  absl::StatusOr<IdentityPtr> user(uint32_t uid) const;

  const SecurityOptions options_;
  const Clock clock_;
  const bool enabled_;
  std::unique_ptr<AuditLog> audit_;
  std::unique_ptr<AuditUpdates> audit_updates_;  // destroyed before audit_, to which it writes
  Mutex reload_mutex_;                           // one reload at a time; acquired before mutex_
  std::vector<std::function<void()>> listeners_ LOCUS_GUARDED_BY(reload_mutex_);
  mutable Mutex mutex_;
  std::shared_ptr<const State> state_ LOCUS_GUARDED_BY(mutex_);
  mutable Mutex users_mutex_;
  mutable absl::flat_hash_map<uint32_t, IdentityPtr> users_ LOCUS_GUARDED_BY(users_mutex_);  // cleared by reload()
  std::atomic<uint64_t> generation_{1};
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_ACCESS_CONTROL_H_
