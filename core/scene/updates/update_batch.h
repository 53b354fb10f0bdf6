// Update batch as borrowed columns, and its acknowledgement. Plain data; the columns outlive the call that takes the
// batch. Order of application: clear, removes, inserts, moves, relabels; all become one revision.
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

// Columns of objects to insert. A column has N entries (N = number of ids), one entry for all items, or none for the
// default in brackets.
struct InsertColumns {
  absl::Span<const uint64_t> ids;
  absl::Span<const float> positions;       // 3N, relative to the frame; either this or positions_f64
  absl::Span<const double> positions_f64;  // 3N, absolute
  absl::Span<const float> rotations;       // 4N, x y z w [identity]
  ShapeKind kind = ShapeKind::kPoint;
  absl::Span<const float> radii;      // N, balls and capsules, >= 0
  absl::Span<const float> extents;    // 3N, half extents of boxes >= 0, or half axes of capsules
  absl::Span<const uint32_t> layers;  // [bit 0]
  absl::Span<const uint64_t> groups;  // [0]
  absl::Span<const uint64_t> tags;    // [0]
};

struct MoveColumns {
  absl::Span<const uint64_t> ids;
  absl::Span<const float> positions;
  absl::Span<const double> positions_f64;
  absl::Span<const float> rotations;  // [unchanged]
  bool teleport = false;
};

struct RelabelColumns {
  absl::Span<const uint64_t> ids;
  absl::Span<const uint32_t> layers;  // [unchanged], like groups and tags
  absl::Span<const uint64_t> groups;
  absl::Span<const uint64_t> tags;
};

struct UpdateBatch {
  Vec3d frame;
  std::optional<uint64_t> tick;  // tick of the batch [the scene's current tick]
  bool clear = false;
  absl::Span<const uint64_t> remove_ids;
  absl::Span<const uint64_t> remove_groups;
  std::vector<InsertColumns> inserts;
  std::vector<MoveColumns> moves;
  std::vector<RelabelColumns> relabels;
  bool upsert = false;
  bool all_or_nothing = false;
  bool restart_ticks = false;
  uint64_t writer = 0;  // random id of the sender, 0 = none; a (writer, batch) pair is applied once
  uint64_t batch = 0;   // sequence number within the writer, from 1 without gaps; 0 = none
};

struct ItemError {
  std::string field;  // column of the value, for example inserts[0].positions
  uint32_t index = 0;
  Id id = kNoId;
  Reason reason = Reason::kUnspecified;
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

// Returns true if the two batches may be applied as one revision: both only move objects, without teleport,
// all_or_nothing or restart_ticks, at the same tick. The second batch wins for objects that both move.
bool may_join(const UpdateBatch& first, const UpdateBatch& second);

// Checks the form of a batch: column lengths, frame, writer and limits. INVALID_ARGUMENT names the wrong field.
absl::Status check_form(const UpdateBatch& batch);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_UPDATES_UPDATE_BATCH_H_
