// Update batch as borrowed columns, and its acknowledgement. Plain data; the columns outlive the call that applies the
// batch. A batch is applied in the order clear, removes, inserts, moves, relabels, instance moves, instance relabels;
// all these changes become one revision. A batch that was sent as several messages has the earlier messages in
// `earlier`; they are applied first, in order.
#ifndef LOCUS_CORE_SCENE_UPDATES_UPDATE_BATCH_H_
#define LOCUS_CORE_SCENE_UPDATES_UPDATE_BATCH_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/types/span.h"
#include "core/base/ids.h"
#include "core/base/refusal.h"
#include "core/geometry/shape.h"

namespace locus {

// Columns of parts of compounds that have the same kind of shape. Let P be the number of positions. Each other column
// has P entries, or one entry for all parts; a column with a default may also have no entries.
struct PartColumns {
  ShapeKind kind = ShapeKind::kBall;  // ball, box or capsule
  absl::Span<const float> positions;  // entries x y z, in the object's own axes
  absl::Span<const float> rotations;  // quaternions x y z w; default: no rotation
  absl::Span<const float> radii;      // as in InsertColumns
  absl::Span<const float> extents;    // as in InsertColumns
  absl::Span<const uint32_t> layers;  // default: all layers

  size_t count() const { return positions.size() / 3; }
};

// Columns of objects to insert. Let N be the number of ids. Each other column has N entries, or one entry for all
// items. A column with a default may also have no entries; then the default applies.
struct InsertColumns {
  absl::Span<const uint64_t> ids;
  absl::Span<const float> positions;       // entries x y z, relative to the frame; empty if positions_f64 is used
  absl::Span<const double> positions_f64;  // entries x y z, absolute; empty if positions is used
  absl::Span<const float> rotations;       // quaternions x y z w; default: no rotation
  ShapeKind kind = ShapeKind::kPoint;
  absl::Span<const float> radii;            // balls and capsules only, >= 0
  absl::Span<const float> extents;          // entries x y z: half extents of boxes, >= 0, or half axes of capsules
  absl::Span<const uint32_t> layers;        // default: bit 0
  absl::Span<const uint64_t> groups;        // default: 0, no group
  absl::Span<const uint64_t> tags;          // default: 0
  absl::Span<const uint64_t> expire_ticks;  // ticks until the object expires; default and 0: it does not expire
  // Parts of each object, compounds only: 1 .. limits::kMaxParts parts. If `layers` has no entries and parts have
  // layers, the objects are in all layers of the parts.
  std::vector<PartColumns> parts;
};

struct MoveColumns {
  absl::Span<const uint64_t> ids;
  absl::Span<const float> positions;
  absl::Span<const double> positions_f64;
  absl::Span<const float> rotations;  // if empty, the rotations do not change
  bool teleport = false;
  // Number P of parts of each object if the moves give parts new poses, else 0. The columns have P entries for each
  // item, or P entries for all items; no entries: the parts keep their positions or rotations.
  uint32_t parts_each = 0;
  absl::Span<const float> part_positions = {};
  absl::Span<const float> part_rotations = {};
};

struct RelabelColumns {
  absl::Span<const uint64_t> ids;
  absl::Span<const uint32_t> layers;  // if empty, the layers do not change; the same holds for groups and tags
  absl::Span<const uint64_t> groups;
  absl::Span<const uint64_t> tags;
};

// Columns of instances to move. Like MoveColumns; a position is the translation of the instance.
struct InstanceMoveColumns {
  absl::Span<const uint64_t> ids;
  absl::Span<const float> positions;
  absl::Span<const double> positions_f64;
  absl::Span<const float> rotations;  // if empty, the rotations do not change
  absl::Span<const float> scales;     // > 0; if empty, the scales do not change
  bool teleport = false;
};

struct UpdateBatch {
  Vec3d frame;
  std::optional<uint64_t> tick;  // tick of the batch; nullopt: the scene's current tick
  bool clear = false;
  absl::Span<const uint64_t> remove_ids;
  absl::Span<const uint64_t> remove_groups;
  std::vector<InsertColumns> inserts;
  std::vector<MoveColumns> moves;
  std::vector<RelabelColumns> relabels;
  std::vector<InstanceMoveColumns> instance_moves;
  std::vector<RelabelColumns> instance_relabels;
  bool upsert = false;
  bool all_or_nothing = false;
  bool restart_ticks = false;
  uint64_t writer = 0;  // writer id; 0: no id; batches with equal (writer, batch) are applied only once
  uint64_t batch = 0;   // number of the batch in the sequence of its writer, from 1 without gaps; 0: no number
  // Lease of the writer in milliseconds, from this batch on: see core/scene/objects/leases.h. 0: the batch begins no
  // lease and changes none.
  uint32_t lease_ms = 0;
  // Writer whose lease ends: the objects of the lease are removed. Only Scene::end_lease() makes such batches, which
  // have no other content; a batch for a writer without a lease has no effect. 0: no lease ends.
  uint64_t end_lease = 0;
  // Earlier messages of the same revision, in order; each satisfies check_earlier(). The tick, the writer and the
  // settings of the revision are those of this batch. Frame and upsert of a message apply to this message only.
  std::vector<UpdateBatch> earlier;
};

struct ItemError {
  // Column of the refused value, for example inserts[0].positions. A wrong value of a compound's part, for example of
  // inserts[0].compound.parts[1].ball.radii, refuses each item of the element.
  std::string field;
  uint32_t index = 0;
  Id id = kNoId;
  Reason reason = Reason::kUnspecified;
  uint32_t message = 0;  // index of the message, if the batch was sent as several messages
};

struct UpdateAck {
  uint64_t epoch = 0;
  uint64_t revision = 0;
  uint64_t tick = 0;
  uint32_t applied = 0;           // number of applied items
  uint32_t refused = 0;           // number of refused items
  std::vector<ItemError> errors;  // at most limits::kMaxListedItemErrors
  bool duplicate = false;
};

// Return the number of parts of compounds that an element of a batch has.
size_t part_count(const InsertColumns& insert);
inline size_t part_count(const MoveColumns& move) { return move.ids.size() * size_t{move.parts_each}; }

// Returns true if the two batches may be applied as one revision: both batches have the same tick and only move
// objects, without new poses of parts, teleport, all_or_nothing, restart_ticks, lease_ms or earlier messages. If both
// batches move an object, the second batch determines the result.
bool may_join(const UpdateBatch& first, const UpdateBatch& second);

// Returns true if the batch or one of its earlier messages changes instances.
bool has_instances(const UpdateBatch& batch);

// Return the number of items of the batch and its earlier messages, and the number of their lists. Parts of compounds
// count as items, because they take memory like objects, and their lists as lists.
uint64_t count_items(const UpdateBatch& batch);
uint64_t count_lists(const UpdateBatch& batch);

// Checks the form of a batch: column lengths, frame, writer, earlier messages and limits. Returns INVALID_ARGUMENT,
// naming the invalid field, if the form is wrong.
absl::Status check_form(const UpdateBatch& batch);

// Checks that a batch has no setting that only the last message of a revision may have: tick, restart_ticks, writer,
// batch, all_or_nothing and lease_ms. Returns INVALID_ARGUMENT, naming the field, if it has one.
absl::Status check_earlier(const UpdateBatch& batch);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_UPDATES_UPDATE_BATCH_H_
