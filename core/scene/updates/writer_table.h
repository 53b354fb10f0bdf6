// Table of the last batch and ack of each known writer, so that a batch that is sent twice is applied once. If the
// table is full, the least recently active writer is evicted. The next batch of an evicted writer is refused, because
// the table cannot know whether this batch was applied before. However, if an evicted writer repeats its batch 1, the
// table takes the writer for a new one, and the batch is applied again. If the stored acks would list more than
// kMaxKeptErrors errors, the acks of all writers are dropped, but the writers and their batch numbers are kept. A value
// type; one thread at a time. Invariants: at most limits::kMaxWriters writers are stored, no writer id is 0, and no
// activity count exceeds clock_; kept_errors_ is the number of errors in all stored acks, at most kMaxKeptErrors.
#ifndef LOCUS_CORE_SCENE_UPDATES_WRITER_TABLE_H_
#define LOCUS_CORE_SCENE_UPDATES_WRITER_TABLE_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "core/base/limits.h"
#include "core/scene/updates/update_batch.h"

namespace locus {

class WriterTable {
 public:
  // Maximum number of item errors in all stored acks.
  static constexpr size_t kMaxKeptErrors = size_t{64} * limits::kMaxListedItemErrors;

  // Returns nullopt if the batch must be applied, because it is the next batch of its writer or has no writer. If the
  // batch was applied before, returns an ack that is marked as duplicate: the stored ack of the batch or, if this ack
  // is not stored, an empty ack. Returns FAILED_PRECONDITION BATCH_GAP if an earlier batch is missing.
  absl::StatusOr<std::optional<UpdateAck>> admit(uint64_t writer, uint64_t batch) const;
  // Stores the number and the ack of the latest batch of a writer. Evicts another writer, or drops all acks, if a limit
  // would be exceeded. Does nothing for writer 0.
  void record(uint64_t writer, uint64_t batch, const UpdateAck& ack);

  struct Writer {
    uint64_t number = 0;  // writer id
    uint64_t batch = 0;   // number of the writer's last batch
    uint64_t heard = 0;   // activity count: higher for a writer that was active later
    UpdateAck ack;        // ack of the last batch; epoch 0: the ack was dropped
  };
  // Returns all known writers, ascending by writer id. O(writers).
  std::vector<Writer> writers() const;
  size_t size() const { return writers_.size(); }
  // Inserts an entry that writers() returned. Returns false and changes nothing if a limit would be exceeded, the
  // writer is known, or the number of the writer or of its batch is 0.
  bool restore(Writer writer);

 private:
  // Checks the invariants of the class comment, except the sum over all writers. O(1).
  void check_invariants() const;
  struct Last {
    uint64_t batch = 0;
    uint64_t heard = 0;
    UpdateAck ack;
  };
  void forget_oldest();
  void forget_acks();

  absl::flat_hash_map<uint64_t, Last> writers_;
  uint64_t clock_ = 0;
  size_t kept_errors_ = 0;  // number of errors in all acks of writers_
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_UPDATES_WRITER_TABLE_H_
