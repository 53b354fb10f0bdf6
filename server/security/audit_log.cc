#include "server/security/audit_log.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace locus::server {
namespace {

// Length of the window of time in which the refusals of a caller are counted together.
constexpr std::chrono::seconds kTallyWindow{1};

void cut(std::string& text) {
  if (text.size() > kMaxAuditTextBytes) text.resize(kMaxAuditTextBytes);
}

}  // namespace

// Entries that the writer took from the queue in one step.
struct AuditLog::Batch {
  std::deque<AuditEntry> entries;
  std::vector<AuditEntry> notes;  // one for each caller with refusals that were only counted
  std::array<Dropped, kKinds> dropped;
  bool reopen = false;
};

absl::StatusOr<std::unique_ptr<AuditLog>> AuditLog::open(const std::string& file, uint64_t max_bytes,
                                                         size_t max_queue) {
  Files files;
  ASSIGN_OR_RETURN(files[kChange], RotatedFile::open(file, max_bytes, kAuditFiles));
  ASSIGN_OR_RETURN(files[kRefusal], RotatedFile::open(file + ".refused", max_bytes, kAuditFiles));
  return std::unique_ptr<AuditLog>(new AuditLog(std::move(files), max_queue));
}

AuditLog::AuditLog(Files files, size_t max_queue)
    : max_queue_(max_queue), files_(std::move(files)), writer_([this] { run(); }) {}

AuditLog::~AuditLog() {
  {
    MutexLock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  writer_.join();
}

void AuditLog::write(AuditEntry entry) {
  for (std::string* const text :
       {&entry.principal, &entry.peer, &entry.address, &entry.rpc, &entry.subject, &entry.request_id, &entry.text})
    cut(*text);
  const Kind kind = kind_of(entry);
  MutexLock lock(mutex_);
  if (kind == kRefusal) {
    if (!tally_ends_) {
      tally_ends_ = std::chrono::steady_clock::now() + kTallyWindow;
      changed_.notify_all();
    }
    if (!tally_.count(entry)) return;
  }
  if (queue_.size() >= (kind == kRefusal ? max_queue_ / 2 : max_queue_)) {
    ++dropped_[kind].entries;
    ++lost_;
    dropped_[kind].last_ms = entry.unix_ms;
    return;
  }
  queue_.push_back(std::move(entry));
  ++queued_;
  if (queue_.size() == 1) changed_.notify_all();
}

void AuditLog::reopen() {
  MutexLock lock(mutex_);
  reopen_ = true;
  changed_.notify_all();
}

void AuditLog::flush() {
  MutexLock lock(mutex_);
  const uint64_t last = queued_;
  while (written_ < last) changed_.wait(mutex_);
}

uint64_t AuditLog::lost() const {
  MutexLock lock(mutex_);
  return lost_;
}

bool AuditLog::has_work() const {
  return !queue_.empty() || dropped_[kChange].entries > 0 || dropped_[kRefusal].entries > 0 || reopen_;
}

// Waits for work and moves it to `batch`. Returns false if there is no work left and the writer must stop.
bool AuditLog::take_batch(Batch& batch) {
  MutexLock lock(mutex_);
  bool window_over = false;
  while (!has_work() && !stopping_ && !window_over) {
    if (tally_ends_)
      window_over = !changed_.wait_until(mutex_, *tally_ends_);
    else
      changed_.wait(mutex_);
  }
  if (tally_ends_ && (stopping_ || *tally_ends_ <= std::chrono::steady_clock::now())) {
    batch.notes = tally_.end_window();
    tally_ends_.reset();
  } else if (!has_work()) {
    return !stopping_;
  }
  batch.entries.swap(queue_);
  batch.dropped = std::exchange(dropped_, {});
  batch.reopen = std::exchange(reopen_, false);
  return true;
}

// Writes the lines of a batch. Returns the number of entries that could not be written.
uint64_t AuditLog::write_batch(const Batch& batch) {
  if (batch.reopen)
    for (const auto& file : files_) (void)file->reopen();  // after a failure the old file stays in use
  uint64_t refused = 0;
  for (const AuditEntry& entry : batch.entries)
    refused += files_[kind_of(entry)]->append(audit_line(entry)).ok() ? 0 : 1;
  for (const AuditEntry& note : batch.notes) refused += files_[kRefusal]->append(audit_line(note)).ok() ? 0 : 1;
  for (size_t kind = 0; kind < kKinds; ++kind) {
    if (batch.dropped[kind].entries == 0) continue;
    AuditEntry note;
    note.unix_ms = batch.dropped[kind].last_ms;
    note.code = absl::StatusCode::kResourceExhausted;
    note.text =
        absl::StrCat(batch.dropped[kind].entries, " entries are missing here: they came faster than the disk writes");
    (void)files_[kind]->append(audit_line(note));  // lost_ includes these entries already
  }
  return refused;
}

void AuditLog::run() {
  for (;;) {
    Batch batch;
    if (!take_batch(batch)) return;
    const uint64_t refused = write_batch(batch);
    MutexLock lock(mutex_);
    written_ += batch.entries.size();
    lost_ += refused;
    changed_.notify_all();
  }
}

}  // namespace locus::server
