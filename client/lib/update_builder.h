// Builder of an update batch, row by row or by whole columns. For callers that stream moving objects. The builder
// checks nothing: the server checks each item, and the ack lists the refused items. Not thread-safe. build() resets the
// builder.
//
// Inserted rows with the same shape and kind of position (relative or absolute) share one Insert message and keep the
// order in which they were added. A compound shares the Insert message of the compound before it if their parts are
// equal. Moves always stay in the order in which they were added, since the later of two moves of one object wins.
// Therefore a move begins a new Move message if its MoveKind or its columns (with or without rotation, number of parts,
// relative or absolute position) differ from those of the previous move. A relabel begins a new Relabel message if it
// sets other kinds of labels than the previous relabel. Moves and relabels of instances do the same.
#ifndef LOCUS_CLIENT_LIB_UPDATE_BUILDER_H_
#define LOCUS_CLIENT_LIB_UPDATE_BUILDER_H_

#include <array>
#include <cstdint>
#include <optional>

#include "absl/types/span.h"
#include "client/lib/compound.h"
#include "client/lib/values.h"
#include "locus/v1/update_service.pb.h"

namespace locus::client {

// Columns of N objects, borrowed for the call. `ids` has N entries; every other column has N entries, one entry for all
// objects, or none. Exactly one of the two position columns must be given.
struct InsertColumns {
  absl::Span<const uint64_t> ids;
  absl::Span<const float> positions = {};        // 3N, relative to the frame
  absl::Span<const double> positions_f64 = {};   // 3N, absolute
  absl::Span<const float> rotations = {};        // 4N; none = identity
  absl::Span<const uint32_t> layers = {};        // none = 1, or all layers of a compound's parts
  absl::Span<const uint64_t> groups = {};        // none = 0
  absl::Span<const uint64_t> tags = {};          // none = 0
  absl::Span<const uint64_t> expire_ticks = {};  // none or 0 = until the object is removed
};

// With poses of parts, all objects are compounds of `parts_each` = P parts.
struct MoveColumns {
  absl::Span<const uint64_t> ids;
  absl::Span<const float> positions = {};       // 3N, relative to the frame
  absl::Span<const double> positions_f64 = {};  // 3N, absolute
  absl::Span<const float> rotations = {};       // 4N; none = rotations do not change
  uint32_t parts_each = 0;
  absl::Span<const float> part_positions = {};  // 3NP, or 3P for all objects; none = parts keep their positions
  absl::Span<const float> part_rotations = {};  // 4NP, or 4P for all objects; none = parts keep their rotations
};

struct InstanceMoveColumns {
  absl::Span<const uint64_t> ids;
  absl::Span<const float> positions = {};       // 3N, relative to the frame
  absl::Span<const double> positions_f64 = {};  // 3N, absolute
  absl::Span<const float> rotations = {};       // 4N; none = rotations do not change
  absl::Span<const float> scales = {};          // none = scales do not change
};

// New labels of one object or instance. Labels without a value do not change.
struct Relabeling {
  std::optional<uint32_t> layers = std::nullopt;
  std::optional<uint64_t> group = std::nullopt;
  std::optional<uint64_t> tag = std::nullopt;
};

// Kind of a move. Queries about the history never place an object between its positions before and after a teleport.
enum class MoveKind { kContinuous, kTeleport };

class UpdateBuilder {
 public:
  // Sets the frame of the batch: the origin to which float positions are relative.
  UpdateBuilder& frame(const Double3& origin);
  UpdateBuilder& tick(uint64_t tick);
  // Makes an insert with the id of an existing object replace that object, instead of being refused.
  UpdateBuilder& upsert();
  // Makes the server refuse the whole batch if it would refuse any item of the batch.
  UpdateBuilder& all_or_nothing();
  // Makes the server drop the scene's history, and accept the batch's tick even if it is lower than the scene's tick.
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
  UpdateBuilder& insert_compound(uint64_t id, const Position& position, const Compound& compound,
                                 const Rotation& rotation = {}, const Labels& labels = {});

  // Insert whole columns, which are copied unchanged. Each call adds an Insert message of its own.
  UpdateBuilder& insert_points(const InsertColumns& columns);
  UpdateBuilder& insert_balls(const InsertColumns& columns, absl::Span<const float> radii);
  UpdateBuilder& insert_boxes(const InsertColumns& columns, absl::Span<const float> half_extents);
  UpdateBuilder& insert_capsules(const InsertColumns& columns, absl::Span<const float> half_axes,
                                 absl::Span<const float> radii);
  // Inserts compounds that all have the parts of `compound`.
  UpdateBuilder& insert_compounds(const InsertColumns& columns, const Compound& compound);

  UpdateBuilder& move(uint64_t id, const Position& position, const std::optional<Rotation>& rotation = std::nullopt,
                      MoveKind kind = MoveKind::kContinuous);
  // Moves one compound and sets the poses of all its parts, in order. The server refuses the row if the compound has
  // another number of parts.
  UpdateBuilder& move_compound(uint64_t id, const Position& position, absl::Span<const PartPose> parts,
                               const std::optional<Rotation>& rotation = std::nullopt,
                               MoveKind kind = MoveKind::kContinuous);
  UpdateBuilder& moves(const MoveColumns& columns, MoveKind kind = MoveKind::kContinuous);

  UpdateBuilder& relabel(uint64_t id, const Relabeling& labels);

  // Move one instance, or whole columns, which are copied unchanged. A position is that of the origin of the mesh.
  // Instances without a given rotation or scale keep theirs.
  UpdateBuilder& move_instance(uint64_t id, const Position& position,
                               const std::optional<Rotation>& rotation = std::nullopt,
                               std::optional<float> scale = std::nullopt, MoveKind kind = MoveKind::kContinuous);
  UpdateBuilder& move_instances(const InstanceMoveColumns& columns, MoveKind kind = MoveKind::kContinuous);
  // Sets labels of one instance. Layers 0 hide the instance, and other layers show it again.
  UpdateBuilder& relabel_instance(uint64_t id, const Relabeling& labels);

  // Returns the batch, and leaves the builder empty with every setting at its default.
  v1::UpdateBatch build();

 private:
  enum class Form { kPoint, kBall, kBox, kCapsule, kCompound };

  // Returns the index into row_inserts_ for rows of this form and kind of position.
  static size_t slot_of(Form form, const Position& position);
  v1::Insert& add_row(Form form, uint64_t id, const Position& position, const Rotation& rotation, const Labels& labels);
  v1::Insert& add_columns(const InsertColumns& columns);
  v1::Move& add_move(uint64_t id, const Position& position, const std::optional<Rotation>& rotation, size_t parts,
                     MoveKind kind);

  v1::UpdateBatch batch_;
  bool move_takes_rows_ = false;           // move() may append rows to the last entry of batch_.moves
  bool instance_move_takes_rows_ = false;  // the same for move_instance() and batch_.instance_moves
  // Two indices into batch_.inserts for each form of an object: the first is the entry that collects rows with relative
  // positions, the second is the entry that collects rows with absolute positions; -1 = no such entry yet.
  std::array<int, 10> row_inserts_ = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_UPDATE_BUILDER_H_
