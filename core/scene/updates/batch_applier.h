// One batch being applied: an overlay of changed objects over the revision before, so that a refused batch leaves no
// trace and the index hears of each object once.
#ifndef LOCUS_CORE_SCENE_UPDATES_BATCH_APPLIER_H_
#define LOCUS_CORE_SCENE_UPDATES_BATCH_APPLIER_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "core/scene/objects/object_store.h"
#include "core/scene/statics/static_set.h"
#include "core/scene/updates/pose_reader.h"
#include "core/scene/updates/update_batch.h"

namespace locus {

// Whether it matters that an object ended and another one began under its id in one batch, or that it jumped: only to
// questions about the past.
enum class TrackLifetimes : uint8_t { kNo, kYes };

class BatchApplier {
 public:
  // All three are borrowed for the life of this object. `batch` has passed check_form().
  BatchApplier(const ObjectStore& objects, const StaticSet& statics, const UpdateBatch& batch,
               TrackLifetimes lives = TrackLifetimes::kNo);

  // Clear, removes, inserts, moves, relabels: in this order, once.
  void run();

  // Objects there are now. Only inserts add any, and nothing removes after them: at its highest after run().
  size_t object_count() const { return count_; }
  uint32_t applied() const { return applied_; }
  uint32_t refused() const { return refused_; }
  std::vector<ItemError>& errors() { return errors_; }

  // What run() came to: objects that go, as they were, and objects that come, as they are. A changed object is in both,
  // one that ended as it began in neither, unless it was reborn.
  struct Difference {
    std::vector<Object> removed;
    std::vector<Object> added;
    absl::flat_hash_set<Id> replaced;  // where lives are told: new lives under ids of old ones, those that jumped too
    bool empty() const { return removed.empty() && added.empty(); }
  };
  Difference difference();

 private:
  std::optional<Object> current(Id id) const;
  void put(const Object& object) { changed_[object.id] = object; }
  void begin_life(Id id) {
    if (track_lifetimes_ == TrackLifetimes::kYes) replaced_.insert(id);
  }
  void refuse(std::string field, size_t index, Id id, Reason reason);
  void remove_ids();
  void remove_groups();
  void insert(const InsertColumns& columns, const std::string& field);
  bool may_insert(Id id, uint32_t index, const std::string& field);
  void move(const MoveColumns& columns, const std::string& field);
  void relabel(const RelabelColumns& columns, const std::string& field);
  bool read_pose(const PoseReader& poses, uint32_t index, Id id, const std::string& field, Shape& shape);
  bool read_shape(const InsertColumns& columns, uint32_t index, Id id, const std::string& field, Shape& shape);

  const ObjectStore& objects_;
  const StaticSet& statics_;
  const UpdateBatch& batch_;
  const TrackLifetimes track_lifetimes_;
  absl::flat_hash_set<Id> replaced_;
  size_t count_;                                            // objects there are after what was applied so far
  absl::flat_hash_map<Id, std::optional<Object>> changed_;  // nothing = removed
  uint32_t applied_ = 0;
  uint32_t refused_ = 0;
  std::vector<ItemError> errors_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_UPDATES_BATCH_APPLIER_H_
