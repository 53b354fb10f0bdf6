// One batch of updates as borrowed columns, and what became of it. The columns live as long as the call that takes
// them. Order of application: clear, removes, inserts, moves, relabels; all become one revision.
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

// A column has N entries (N = number of ids), one for all, or none for the default in brackets.
struct InsertColumns {
  absl::Span<const uint64_t> ids;
  absl::Span<const float> positions;       // 3N relative to the frame; this or the next
  absl::Span<const double> positions_f64;  // 3N absolute
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
  absl::Span<const float> rotations;  // [kept]
  bool teleport = false;
};

struct RelabelColumns {
  absl::Span<const uint64_t> ids;
  absl::Span<const uint32_t> layers;  // [kept], likewise below
  absl::Span<const uint64_t> groups;
  absl::Span<const uint64_t> tags;
};

struct UpdateBatch {
  Vec3d frame;
  std::optional<uint64_t> tick;  // [the scene's current tick]
  bool clear = false;
  absl::Span<const uint64_t> remove_ids;
  absl::Span<const uint64_t> remove_groups;
  std::vector<InsertColumns> inserts;
  std::vector<MoveColumns> moves;
  std::vector<RelabelColumns> relabels;
  bool upsert = false;
  bool all_or_nothing = false;
  bool restart_ticks = false;
  uint64_t writer = 0;  // with `batch`: applied once however often it is sent
  uint64_t batch = 0;
};

struct ItemError {
  std::string field;  // for example inserts[0].positions
  uint32_t index = 0;
  Id id = kNoId;
  Reason reason = Reason::kUnspecified;
};

struct UpdateAck {
  uint64_t epoch = 0;
  uint64_t revision = 0;
  uint64_t tick = 0;
  uint32_t applied = 0;  // items
  uint32_t refused = 0;
  std::vector<ItemError> errors;  // at most limits::kMaxListedItemErrors
  bool duplicate = false;
};

// Whether both only move objects, at one tick and item by item, so that they may become one revision: what the second
// moves is where the second says, and all else where the first says.
bool may_join(const UpdateBatch& first, const UpdateBatch& second);

// The form of a batch: column lengths, frame and limits. INVALID_ARGUMENT naming the field.
absl::Status check_form(const UpdateBatch& batch);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_UPDATES_UPDATE_BATCH_H_
