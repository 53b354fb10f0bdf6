// Accepted updates of objects in the audit log: too frequent for a line each, they are counted by principal and scene,
// and each minute one line says how many there were.
//
// Threads: every member may be called from any thread. Counting takes 0.2 us. Invariant: at most kMaxAuditedPairs pairs
// are kept; with one more, all are written early.
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
  uint64_t items = 0;  // objects that it changed
};

class AuditUpdates {
 public:
  // `log` must outlive the result.
  explicit AuditUpdates(AuditLog& log) : log_(log) {}
  // Writes what is counted.
  ~AuditUpdates() { write_all(); }
  AuditUpdates(const AuditUpdates&) = delete;
  AuditUpdates& operator=(const AuditUpdates&) = delete;

  // Counts an update at the time `unix_ms`, milliseconds since 1970.
  void count(const AuditedUpdate& update, int64_t unix_ms) LOCUS_EXCLUDES(mutex_);
  // Writes what is counted if the first of it was counted a minute ago. Call it at least every few seconds.
  void tick(int64_t unix_ms) LOCUS_EXCLUDES(mutex_);

 private:
  struct Sum {
    std::string peer;  // of the last update, as `rpc`
    std::string rpc;
    uint64_t batches = 0;
    uint64_t items = 0;
    int64_t first_ms = 0;
    int64_t last_ms = 0;
  };
  using Sums = absl::flat_hash_map<std::pair<std::string, std::string>, Sum>;

  void write_all() LOCUS_EXCLUDES(mutex_);
  void write(const Sums& sums);

  AuditLog& log_;
  Mutex mutex_;
  Sums sums_ LOCUS_GUARDED_BY(mutex_);             // by principal and scene
  int64_t since_ms_ LOCUS_GUARDED_BY(mutex_) = 0;  // time of the first update in sums_
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_AUDIT_UPDATES_H_
