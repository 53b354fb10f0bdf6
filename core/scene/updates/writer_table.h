// What each known writer sent last, so that a batch sent twice is applied once. Bounded: the writer heard longest ago
// is forgotten first, and its next batch is refused rather than risked. Old acks go earlier if they list too many
// errors. A value type: a copy is the table at that moment.
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
  // Item errors listed by all acks that are kept.
  static constexpr size_t kMaxKeptErrors = size_t{64} * limits::kMaxListedItemErrors;

  // Nothing if the batch is new and next in order; the old ack (or one marked duplicate) if it was applied before;
  // FAILED_PRECONDITION BATCH_GAP if a batch before it is missing.
  absl::StatusOr<std::optional<UpdateAck>> admit(uint64_t writer, uint64_t batch) const;
  // Whether admit() would say nothing.
  bool is_new(uint64_t writer, uint64_t batch) const;
  void record(uint64_t writer, uint64_t batch, const UpdateAck& ack);

  struct Writer {
    uint64_t number = 0;
    uint64_t batch = 0;
    uint64_t heard = 0;  // higher for whoever was heard later
    UpdateAck ack;       // its epoch is 0 where it was forgotten
  };
  // All that are known, by number.
  std::vector<Writer> writers() const;
  size_t size() const { return writers_.size(); }
  // Puts back what writers() gave. False, and no change, for more than fits, or for a writer that is known.
  bool restore(Writer writer);

 private:
  struct Last {
    uint64_t batch = 0;
    uint64_t heard = 0;
    UpdateAck ack;
  };
  void forget_oldest();
  void forget_acks();

  absl::flat_hash_map<uint64_t, Last> writers_;
  uint64_t clock_ = 0;
  size_t kept_errors_ = 0;  // of all acks in writers_
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_UPDATES_WRITER_TABLE_H_
