// Group commit of appends: appends that wait at the same time, of all scenes, share one transaction, because an engine
// is used up by commits, not by bytes. One of the waiting threads commits for all of its group; there is no thread of
// its own. (The method: D. DeWitt et al., "Implementation Techniques for Main Memory Database Systems", 1984.)
// An append whose scene is locked in the engine is committed again alone, after those that wait, so that it delays no
// other scene.
//
// Threads: any thread, but only one append of a scene at a time. Invariants: a group has at most one append of a scene,
// ordered by scene, so that two groups lock rows in the same order; at most `committers` groups are committed at once.
#ifndef LOCUS_SERVER_STORAGE_POSTGRES_APPEND_QUEUE_H_
#define LOCUS_SERVER_STORAGE_POSTGRES_APPEND_QUEUE_H_

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <vector>

#include "absl/status/status.h"
#include "absl/types/span.h"
#include "core/base/mutex.h"
#include "core/scene/log/update_log.h"

namespace locus::server {

// One append of a scene. The members up to `chains` are the caller's; the spans must stay valid until run() returns.
struct Append {
  SceneKey scene = 0;
  uint64_t token = 0;   // the append counts only while the scene's token is this one
  uint64_t before = 0;  // sequence number of the record before the first of the append
  absl::Span<const LogEntry> entries;
  absl::Span<const uint64_t> chains;  // running checksum after each entry
  uint64_t bytes = 0;                 // total size of the entries

  // Set by the function that commits. kUnknown: it could not find out whether the append was written. kBlocked: it was
  // not written because another transaction has locked the scene's row; it is to be committed again.
  enum class Outcome : uint8_t { kNotWritten, kWritten, kFenced, kUnknown, kBlocked };
  Outcome outcome = Outcome::kNotWritten;
  absl::Status failure;  // reason of kNotWritten and kUnknown
  // Time at which the commit function gives up; set by its first call for this append.
  std::chrono::steady_clock::time_point until;
  bool sent = false;  // it was sent on a connection that was lost, and may still arrive there

 private:
  friend class AppendQueue;
  ConditionVariable changed;  // notified when the append is done, or may be committed by its own thread
  bool taken = false;
  bool alone = false;  // it was blocked
  bool done = false;
};

// Statement that appends one scene's records if this daemon still leads the scene and no record is missing; inserts no
// row otherwise. Parameters: scene, token, last sequence number before and after the append, running checksum after it,
// epoch; arrays of writers, batch numbers, running checksums and bytes.
inline constexpr const char* kAppendStatement =
    "WITH moved AS (UPDATE locus.scene_log SET last = $4::bigint, chain = $5::bigint"
    " WHERE scene = $1::bigint AND token = $2::bigint AND last = $3::bigint RETURNING scene)"
    " INSERT INTO locus.record (scene, sequence, epoch, writer, batch, chain, bytes)"
    " SELECT moved.scene, $3::bigint + added.number, $6::bigint, added.writer, added.batch, added.chain, added.bytes"
    " FROM moved, ROWS FROM (unnest($7::bigint[]), unnest($8::bigint[]), unnest($9::bigint[]), unnest($10::bytea[]))"
    " WITH ORDINALITY AS added (writer, batch, chain, bytes, number)";

class AppendQueue {
 public:
  // Function that commits the appends of one group and sets the outcome of each. It is called again, with this append
  // alone, for an append that it leaves kBlocked.
  using Commit = std::function<void(absl::Span<Append* const>)>;

  static constexpr uint64_t kGroupBytes = uint64_t{8} << 20;  // a larger append is a group of its own
  static constexpr size_t kGroupAppends = 256;

  AppendQueue(size_t committers, Commit commit) : committers_(committers), commit_(std::move(commit)) {}

  // Returns when the outcome of `append` is set.
  void run(Append& append) LOCUS_EXCLUDES(mutex_);

 private:
  std::vector<Append*> take_group() LOCUS_REQUIRES(mutex_);

  const size_t committers_;
  const Commit commit_;
  Mutex mutex_;
  std::deque<Append*> waiting_ LOCUS_GUARDED_BY(mutex_);
  size_t committing_ LOCUS_GUARDED_BY(mutex_) = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_POSTGRES_APPEND_QUEUE_H_
