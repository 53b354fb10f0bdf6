// Builder of an update batch, row by row or by whole columns. For callers that stream moving objects. Nothing is
// checked here: the server checks each item, and the ack lists the refused ones. Not thread-safe. build() resets the
// builder.
//
// Rows of one shape and one kind of position (relative or absolute) share one Insert, in the order added. Moves and
// relabels keep the order added over all of them, since the later of two moves of one object wins: a row of another
// form than the one before (with or without rotation, relative or absolute) opens a new entry.
#ifndef LOCUS_CLIENT_LIB_UPDATE_BUILDER_H_
#define LOCUS_CLIENT_LIB_UPDATE_BUILDER_H_

#include <array>
#include <cstdint>
#include <optional>

#include "absl/types/span.h"
#include "client/lib/values.h"
#include "locus/v1/update_service.pb.h"

namespace locus::client {

// Columns of N objects, borrowed for the call. `ids` has N entries; another column has N entries, one for all or none,
// and exactly one of the two position columns is given.
struct InsertColumns {
  absl::Span<const uint64_t> ids;
  absl::Span<const float> positions = {};       // 3N, relative to the frame
  absl::Span<const double> positions_f64 = {};  // 3N, absolute
  absl::Span<const float> rotations = {};       // 4N; none = identity
  absl::Span<const uint32_t> layers = {};       // none = 1
  absl::Span<const uint64_t> groups = {};       // none = 0
  absl::Span<const uint64_t> tags = {};         // none = 0
};

struct MoveColumns {
  absl::Span<const uint64_t> ids;
  absl::Span<const float> positions = {};       // 3N, relative to the frame
  absl::Span<const double> positions_f64 = {};  // 3N, absolute
  absl::Span<const float> rotations = {};       // 4N; none = kept
};

// New labels of one object; absent ones are kept.
struct Relabeling {
  std::optional<uint32_t> layers = std::nullopt;
  std::optional<uint64_t> group = std::nullopt;
  std::optional<uint64_t> tag = std::nullopt;
};

// Kind of a move. After a teleport, queries about the history never place the object between the two positions.
enum class MoveKind { kContinuous, kTeleport };

class UpdateBuilder {
 public:
  // Sets the frame of the batch. Float positions are relative to it.
  UpdateBuilder& frame(const Double3& origin);
  UpdateBuilder& tick(uint64_t tick);
  // Makes an insert of a known id replace the object instead of being refused.
  UpdateBuilder& upsert();
  // Makes one refused item refuse the whole batch.
  UpdateBuilder& all_or_nothing();
  // Drops the history and takes the batch's tick even if it is lower than the scene's.
  UpdateBuilder& restart_ticks();
  // Removes all objects before the other changes of the batch.
  UpdateBuilder& clear();

  UpdateBuilder& remove(uint64_t id);
  UpdateBuilder& remove(absl::Span<const uint64_t> ids);
  UpdateBuilder& remove_group(uint64_t group);

  // Insert one object. Positions are centers.
  UpdateBuilder& insert_point(uint64_t id, const Position& position, const Labels& labels = {});
  UpdateBuilder& insert_ball(uint64_t id, const Position& position, float radius, const Labels& labels = {});
  UpdateBuilder& insert_box(uint64_t id, const Position& position, const Float3& half_extents,
                            const Rotation& rotation = {}, const Labels& labels = {});
  // Inserts one capsule. `half_axis` is the vector from the center to one end of the inner segment, in the capsule's
  // own axes.
  UpdateBuilder& insert_capsule(uint64_t id, const Position& position, const Float3& half_axis, float radius,
                                const Rotation& rotation = {}, const Labels& labels = {});

  // Insert whole columns, which are copied unchanged; each call makes an Insert of its own.
  UpdateBuilder& insert_points(const InsertColumns& columns);
  UpdateBuilder& insert_balls(const InsertColumns& columns, absl::Span<const float> radii);
  UpdateBuilder& insert_boxes(const InsertColumns& columns, absl::Span<const float> half_extents);
  UpdateBuilder& insert_capsules(const InsertColumns& columns, absl::Span<const float> half_axes,
                                 absl::Span<const float> radii);

  UpdateBuilder& move(uint64_t id, const Position& position, const std::optional<Rotation>& rotation = std::nullopt,
                      MoveKind kind = MoveKind::kContinuous);
  UpdateBuilder& moves(const MoveColumns& columns, MoveKind kind = MoveKind::kContinuous);

  UpdateBuilder& relabel(uint64_t id, const Relabeling& labels);

  // Returns the batch, and leaves the builder empty with every setting at its default.
  v1::UpdateBatch build();

 private:
  enum class Form { kPoint, kBall, kBox, kCapsule };

  v1::Insert& add_row(Form form, uint64_t id, const Position& position, const Rotation& rotation, const Labels& labels);
  v1::Insert& add_columns(const InsertColumns& columns);

  v1::UpdateBatch batch_;
  bool move_takes_rows_ = false;  // the last of batch_.moves was added by row, not as whole columns
  // Index of the entry of batch_.inserts that collects rows of each form, relative then absolute; -1 = none yet.
  std::array<int, 8> row_inserts_ = {-1, -1, -1, -1, -1, -1, -1, -1};
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_UPDATE_BUILDER_H_
