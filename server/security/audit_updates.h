// Counts accepted updates of objects for the audit log. Updates are too frequent for one line each, so each minute one
// line for each principal and scene reports how many updates there were.
//
// Threads: every member may be called from any thread. Counting takes 0.2 us. Invariant: at most kMaxAuditedPairs pairs
// of principal and scene are kept; to make room for one more pair, all pairs are removed and their lines are written.
#ifndef LOCUS_SERVER_SECURITY_AUDIT_UPDATES_H_
#define LOCUS_SERVER_SECURITY_AUDIT_UPDATES_H_

#include <cstdint>
#include <string>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/string_view.h"
#include "core/base/mutex.h"
#include "server/security/audit_log.h"

namespace locus::server {

// An update that was applied.
struct AuditedUpdate {
  absl::string_view principal;
  absl::string_view peer;
  absl::string_view rpc;  // full method path
  absl::string_view scene;
  uint64_t items = 0;  // number of objects that the update changed
};

class AuditUpdates {
 public:
  // `log` must outlive this object.
  explicit AuditUpdates(AuditLog& log) : log_(log) {}
  // Writes all counts to the log.
  ~AuditUpdates() { write_all(); }
  AuditUpdates(const AuditUpdates&) = delete;
  AuditUpdates& operator=(const AuditUpdates&) = delete;

  // Counts an update at the time `unix_ms`, milliseconds since 1970.
  void count(const AuditedUpdate& update, int64_t unix_ms) LOCUS_EXCLUDES(mutex_);
  // Writes all counts to the log if the first update was counted at least a minute ago. Call it every few seconds.
  void tick(int64_t unix_ms) LOCUS_EXCLUDES(mutex_);

 private:
  struct Sum {
    std::string peer;  // `peer` and `rpc` of the last update
    std::string rpc;
    uint64_t batches = 0;
    uint64_t items = 0;
    int64_t first_ms = 0;
    int64_t last_ms = 0;
  };
  using Sums = absl::flat_hash_map<std::pair<std::string, std::string>, Sum>;

  // Checks the invariant of the class comment. O(1).
  void check_invariants() const LOCUS_REQUIRES(mutex_);
  void write_all() LOCUS_EXCLUDES(mutex_);
  void write(const Sums& sums);

  AuditLog& log_;
  Mutex mutex_;
  Sums sums_ LOCUS_GUARDED_BY(mutex_);             // by principal and scene
  int64_t since_ms_ LOCUS_GUARDED_BY(mutex_) = 0;  // time of the first update in sums_
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_AUDIT_UPDATES_H_
