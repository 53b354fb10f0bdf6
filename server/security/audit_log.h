// Audit log: each change is one line of JSON in FILE, each refusal is one line in FILE.refused. Refusals have a file of
// their own, so that many refusals cannot displace the lines of changes when a full file is rotated. A caller's
// refusals beyond a few a second are counted instead of written (refusal_tally.h). Callers never wait for the disk: one
// thread writes the lines of a bounded queue. If the queue was full, a line reports how many lines were dropped.
// Refusals may fill only half of the queue.
//
// The files have mode 0600. When a file reaches the given size, it is renamed to FILE.1, FILE.1 to FILE.2 and so on;
// four older files are kept. Threads: every member may be called from any thread. A line is written whole or not at
// all, unless the disk fails.
#ifndef LOCUS_SERVER_SECURITY_AUDIT_LOG_H_
#define LOCUS_SERVER_SECURITY_AUDIT_LOG_H_

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/base/mutex.h"
#include "server/security/audit_line.h"
#include "server/security/refusal_tally.h"
#include "server/security/rotated_file.h"
#include "server/security/security_limits.h"

namespace locus::server {

class AuditLog {
 public:
  // Opens or creates the files and starts the writer. Returns the error of a file that cannot be opened.
  static absl::StatusOr<std::unique_ptr<AuditLog>> open(const std::string& file, uint64_t max_bytes,
                                                        size_t max_queue = kMaxAuditQueue);
  // Writes the queued entries and stops the writer.
  ~AuditLog();
  AuditLog(const AuditLog&) = delete;
  AuditLog& operator=(const AuditLog&) = delete;

  // Queues an entry; if the queue is full, counts it as dropped. An entry whose code is not OK is a refusal. Never
  // blocks on the disk.
  void write(AuditEntry entry) LOCUS_EXCLUDES(mutex_);
  // Makes the writer open the files anew before the next line, for example after another program has renamed them.
  void reopen() LOCUS_EXCLUDES(mutex_);
  // Waits until everything queued before is written.
  void flush() LOCUS_EXCLUDES(mutex_);
  // Returns the number of entries that were lost because the queue was full or because they could not be written.
  uint64_t lost() const LOCUS_EXCLUDES(mutex_);

 private:
  enum Kind : uint8_t { kChange, kRefusal };
  static constexpr size_t kKinds = 2;
  using Files = std::array<std::unique_ptr<RotatedFile>, kKinds>;  // by Kind
  // Entries that were dropped since the last line that reports dropped entries.
  struct Dropped {
    uint64_t entries = 0;
    int64_t last_ms = 0;  // time of the last dropped entry
  };
  struct Batch;

  static Kind kind_of(const AuditEntry& entry) { return entry.code == absl::StatusCode::kOk ? kChange : kRefusal; }
  AuditLog(Files files, size_t max_queue);
  // Returns whether the writer has something to do now.
  bool has_work() const LOCUS_REQUIRES(mutex_);
  bool take_batch(Batch& batch) LOCUS_EXCLUDES(mutex_);
  uint64_t write_batch(const Batch& batch);
  void run() LOCUS_EXCLUDES(mutex_);

  const size_t max_queue_;
  const Files files_;  // used by the writer's thread only
  mutable Mutex mutex_;
  ConditionVariable changed_;
  std::deque<AuditEntry> queue_ LOCUS_GUARDED_BY(mutex_);
  uint64_t queued_ LOCUS_GUARDED_BY(mutex_) = 0;   // entries ever queued
  uint64_t written_ LOCUS_GUARDED_BY(mutex_) = 0;  // entries ever taken from the queue and written or lost
  std::array<Dropped, kKinds> dropped_ LOCUS_GUARDED_BY(mutex_);
  RefusalTally tally_ LOCUS_GUARDED_BY(mutex_);
  std::optional<std::chrono::steady_clock::time_point> tally_ends_ LOCUS_GUARDED_BY(mutex_);  // set while tally_ counts
  uint64_t lost_ LOCUS_GUARDED_BY(mutex_) = 0;
  bool reopen_ LOCUS_GUARDED_BY(mutex_) = false;
  bool stopping_ LOCUS_GUARDED_BY(mutex_) = false;
  std::thread writer_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_AUDIT_LOG_H_
