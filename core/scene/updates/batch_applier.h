// Application of one update batch with its earlier messages. Does not change the store: collects the changed objects in
// a table of its own and computes their difference from the store at the end. So a refused batch changes nothing, and
// the grid is updated only once for each object. One thread at a time.
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

// Controls whether BatchApplier::difference() reports the objects that begin a new lifetime (Difference::replaced), and
// whether InstanceApplier gives instances that teleport a new life. Only scenes with history need this.
enum class TrackLifetimes : uint8_t { kNo, kYes };

class BatchApplier {
 public:
  // Borrows `objects`, `statics` and `batch` for the lifetime of this object. Precondition: `batch` has passed
  // check_form().
  BatchApplier(const ObjectStore& objects, const StaticSet& statics, const UpdateBatch& batch,
               TrackLifetimes track_lifetimes = TrackLifetimes::kNo);

  // Makes run() fill inserted(). Call before run().
  void record_inserted() { records_inserted_ = true; }
  // Removes a present object before run(): it expires or its lease ends. Not counted as an applied item.
  void remove_first(Id id);
  // Applies clear, removes, inserts, moves and relabels, in this order: those of the earlier messages first. Call once.
  void run();

  // Returns the number of objects after the batch. A batch removes objects only before its inserts, so no insert makes
  // the number higher than this final number. It is therefore sufficient to check the final number against a limit.
  size_t object_count() const { return count_; }
  uint32_t applied() const { return applied_; }
  uint32_t refused() const { return refused_; }
  std::vector<ItemError>& errors() { return errors_; }

  // Result of run(): objects to remove in their old state, and objects to add in their new state. A changed object is
  // in both lists. An object whose new state equals its old state is in neither list, unless its id is in `replaced`.
  struct Difference {
    std::vector<Object> removed;
    std::vector<Object> added;
    // Ids of objects for which the batch begins a new lifetime: teleported objects, and inserted objects that did not
    // replace a present object by UpdateBatch::upsert. Empty unless TrackLifetimes::kYes.
    absl::flat_hash_set<Id> replaced;
    bool empty() const { return removed.empty() && added.empty(); }
  };
  Difference difference();

  // Returns the ids of the objects that the batch inserted and that still exist after it, each with the ticks until it
  // expires; 0: it does not expire. Empty unless record_inserted() was called.
  const absl::flat_hash_map<Id, uint64_t>& inserted() const { return inserted_; }

 private:
  std::optional<Object> current(Id id) const;
  void put(const Object& object);
  void remove(Id id);
  void apply(const UpdateBatch& message);
  void clear();
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
  // Wrong value of a column: the column's name after the field, and the reason. Unspecified: there is none.
  struct Fault {
    std::string column;
    Reason reason = Reason::kUnspecified;
  };
  bool refuse_fault(const Fault& fault, uint32_t index, Id id, const std::string& field);
  // Read values of one item or part. The columns of PartColumns and of InsertColumns have the same names.
  template <class Columns>
  static Fault read_size(const Columns& columns, size_t index, Shape& shape);
  static Fault read_part(const PartColumns& columns, size_t index, Part& part);
  // Returns the compound of an element, or null and the first wrong value in `fault`.
  const Compound* read_compound(const InsertColumns& columns, Fault& fault);
  // Gives the object the compound with the part poses of item `index`.
  Fault read_part_poses(const MoveColumns& columns, size_t index, Object& object);
  const Compound* keep(std::vector<Part> parts);

  const ObjectStore& objects_;
  const StaticSet& statics_;
  const UpdateBatch& batch_;
  const TrackLifetimes track_lifetimes_;
  const UpdateBatch* message_;  // message that is being applied
  uint32_t message_index_ = 0;
  bool records_inserted_ = false;
  bool cleared_ = false;  // a message had `clear`: the objects of objects_ are removed
  absl::flat_hash_set<Id> replaced_;
  absl::flat_hash_map<Id, uint64_t> inserted_;
  // Ids that earlier messages put into a group. Some may have left the group or were removed. Empty for a batch of one
  // message.
  absl::flat_hash_map<Group, std::vector<Id>> grouped_;
  size_t count_;                                            // number of objects after the items applied so far
  absl::flat_hash_map<Id, std::optional<Object>> changed_;  // new state by id; nullopt: removed
  uint32_t applied_ = 0;
  uint32_t refused_ = 0;
  std::vector<ItemError> errors_;
  std::vector<CompoundPtr> compounds_;  // owns the compounds of changed_ that the batch made
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_UPDATES_BATCH_APPLIER_H_
