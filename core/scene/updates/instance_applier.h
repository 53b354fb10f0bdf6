// Application of the moves and relabels of instances of one update batch with its earlier messages. Does not change the
// set of instances: collects the changed instances, which StaticSet::replace() puts into a new set. One thread at a
// time. Invariant: each changed instance is collected once.
#ifndef LOCUS_CORE_SCENE_UPDATES_INSTANCE_APPLIER_H_
#define LOCUS_CORE_SCENE_UPDATES_INSTANCE_APPLIER_H_

#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/scene/statics/static_set.h"
#include "core/scene/updates/batch_applier.h"
#include "core/scene/updates/pose_reader.h"
#include "core/scene/updates/update_batch.h"

namespace locus {

class InstanceApplier {
 public:
  // Borrows `statics` and `batch` for the lifetime of this object. Precondition: `batch` has passed check_form().
  // Without `track_lifetimes`, a teleport to the place where the instance is changes nothing.
  InstanceApplier(const StaticSet& statics, const UpdateBatch& batch, TrackLifetimes track_lifetimes)
      : statics_(statics), batch_(batch), message_(&batch), track_lifetimes_(track_lifetimes) {}

  // Applies instance moves, then instance relabels, those of the earlier messages first. Call once.
  void run();

  uint32_t applied() const { return applied_; }
  uint32_t refused() const { return refused_; }
  std::vector<ItemError>& errors() { return errors_; }
  // Returns the instances whose state differs from that in the set. Call once, after run().
  std::vector<Instance> changed();

 private:
  void apply(const UpdateBatch& message);
  void move(const InstanceMoveColumns& columns, const std::string& field);
  void relabel(const RelabelColumns& columns, const std::string& field);
  // Reads item `i` of a move. Returns the reason why it is refused, with the name of the column in `column`.
  Reason read_transform(const InstanceMoveColumns& columns, const PoseReader& poses, size_t i, Instance& instance,
                        const char*& column) const;
  // Returns the collected state of the instance, which is first copied from the set; null if there is no such instance.
  Instance* find(Id id);
  void refuse(std::string field, size_t index, Id id, Reason reason);

  const StaticSet& statics_;
  const UpdateBatch& batch_;
  const UpdateBatch* message_;  // message that is being applied
  uint32_t message_index_ = 0;
  const TrackLifetimes track_lifetimes_;
  std::vector<Instance> instances_;
  absl::flat_hash_map<Id, size_t> indices_;  // index in instances_ of each collected instance
  uint32_t applied_ = 0;
  uint32_t refused_ = 0;
  std::vector<ItemError> errors_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_UPDATES_INSTANCE_APPLIER_H_
