#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/limits.h"
#include "core/base/status_macros.h"
#include "server/convert/convert.h"
#include "server/convert/status.h"

namespace locus::server {
namespace {

absl::Status malformed_update(absl::string_view field, absl::string_view message) {
  return refuse_argument(Reason::kMalformed, field, {}, message);
}

// Checks that exactly one of the message's two columns of positions is set or, if the message has no ids, at most one.
template <class Message>
absl::Status check_positions(const Message& message, const std::string& field) {
  const bool relative = !message.positions().empty();
  const bool absolute = !message.positions_f64().empty();
  if (relative && absolute)
    return malformed_update(field + ".positions_f64", "give positions or positions_f64, not both");
  if (!relative && !absolute && !message.ids().empty())
    return malformed_update(field + ".positions", "give positions, relative to the frame, or positions_f64, absolute");
  return absl::OkStatus();
}

// Each entry has at least one part, so that limits::kMaxParts entries are the most that a compound can have.
absl::Status read_parts(const v1::Compound& compound, const std::string& field, InsertColumns* out) {
  if (compound.parts_size() > static_cast<int>(limits::kMaxParts))
    return refuse_limit(field + ".parts", "parts", limits::kMaxParts, compound.parts_size());
  out->parts.reserve(static_cast<size_t>(compound.parts_size()));
  for (int i = 0; i < compound.parts_size(); ++i) {
    const v1::Parts& parts = compound.parts(i);
    PartColumns& columns = out->parts.emplace_back();
    columns.positions = span_of(parts.positions());
    columns.rotations = span_of(parts.rotations());
    columns.layers = span_of(parts.layers());
    switch (parts.shape_case()) {
      case v1::Parts::kBall:
        columns.kind = ShapeKind::kBall;
        columns.radii = span_of(parts.ball().radii());
        break;
      case v1::Parts::kBox:
        columns.kind = ShapeKind::kBox;
        columns.extents = span_of(parts.box().half_extents());
        break;
      case v1::Parts::kCapsule:
        columns.kind = ShapeKind::kCapsule;
        columns.radii = span_of(parts.capsule().radii());
        columns.extents = span_of(parts.capsule().half_axes());
        break;
      case v1::Parts::SHAPE_NOT_SET:
        return malformed_update(absl::StrCat(field, ".parts[", i, "].shape"),
                                "say what the parts are: ball, box or capsule");
    }
  }
  return absl::OkStatus();
}

absl::Status read_shape(const v1::Insert& insert, const std::string& field, InsertColumns* out) {
  switch (insert.shape_case()) {
    case v1::Insert::kPoint:
      out->kind = ShapeKind::kPoint;
      return absl::OkStatus();
    case v1::Insert::kBall:
      out->kind = ShapeKind::kBall;
      out->radii = span_of(insert.ball().radii());
      return absl::OkStatus();
    case v1::Insert::kBox:
      out->kind = ShapeKind::kBox;
      out->extents = span_of(insert.box().half_extents());
      return absl::OkStatus();
    case v1::Insert::kCapsule:
      out->kind = ShapeKind::kCapsule;
      out->radii = span_of(insert.capsule().radii());
      out->extents = span_of(insert.capsule().half_axes());
      return absl::OkStatus();
    case v1::Insert::kCompound:
      out->kind = ShapeKind::kCompound;
      return read_parts(insert.compound(), field + ".compound", out);
    case v1::Insert::SHAPE_NOT_SET:
      break;
  }
  return malformed_update(field + ".shape", "say what the objects are: point, ball, box, capsule or compound");
}

absl::StatusOr<InsertColumns> to_insert(const v1::Insert& insert, const std::string& field) {
  RETURN_IF_ERROR(check_positions(insert, field));
  InsertColumns columns;
  RETURN_IF_ERROR(read_shape(insert, field, &columns));
  columns.ids = span_of(insert.ids());
  columns.positions = span_of(insert.positions());
  columns.positions_f64 = span_of(insert.positions_f64());
  columns.rotations = span_of(insert.rotations());
  columns.layers = span_of(insert.layers());
  columns.groups = span_of(insert.groups());
  columns.tags = span_of(insert.tags());
  columns.expire_ticks = span_of(insert.expire_ticks());
  return columns;
}

absl::StatusOr<MoveColumns> to_move(const v1::Move& move, const std::string& field) {
  RETURN_IF_ERROR(check_positions(move, field));
  // Checked here already, because the memory of the batch is estimated before check_form() is called.
  if (move.parts_each() > limits::kMaxParts)
    return refuse_limit(field + ".parts_each", "parts", limits::kMaxParts, move.parts_each());
  MoveColumns columns;
  columns.ids = span_of(move.ids());
  columns.positions = span_of(move.positions());
  columns.positions_f64 = span_of(move.positions_f64());
  columns.rotations = span_of(move.rotations());
  columns.teleport = move.teleport();
  columns.parts_each = move.parts_each();
  columns.part_positions = span_of(move.part_positions());
  columns.part_rotations = span_of(move.part_rotations());
  return columns;
}

absl::StatusOr<InstanceMoveColumns> to_instance_move(const v1::InstanceMove& move, const std::string& field) {
  RETURN_IF_ERROR(check_positions(move, field));
  InstanceMoveColumns columns;
  columns.ids = span_of(move.ids());
  columns.positions = span_of(move.positions());
  columns.positions_f64 = span_of(move.positions_f64());
  columns.rotations = span_of(move.rotations());
  columns.scales = span_of(move.scales());
  columns.teleport = move.teleport();
  return columns;
}

RelabelColumns to_relabel(const v1::Relabel& relabel) {
  RelabelColumns columns;
  columns.ids = span_of(relabel.ids());
  columns.layers = span_of(relabel.layers());
  columns.groups = span_of(relabel.groups());
  columns.tags = span_of(relabel.tags());
  return columns;
}

// Returns the number of lists of parts, of inserted and of moved compounds.
int64_t part_lists(const v1::UpdateBatch& batch) {
  int64_t lists = 0;
  for (const v1::Insert& insert : batch.inserts())
    if (insert.has_compound()) lists += insert.compound().parts_size();
  for (const v1::Move& move : batch.moves()) lists += move.parts_each() == 0 ? 0 : 1;
  return lists;
}

absl::Status check_batch_form(const v1::UpdateBatch& batch) {
  const int64_t lists = int64_t{batch.inserts_size()} + batch.moves_size() + batch.relabels_size() +
                        batch.instance_moves_size() + batch.instance_relabels_size() + part_lists(batch);
  if (lists > limits::kMaxUpdateLists)
    return refuse_limit("", "update_lists", limits::kMaxUpdateLists, static_cast<double>(lists));
  if (batch.writer() == 0 && batch.batch() != 0)
    return malformed_update("writer", "must be a random number other than 0, because batch is given");
  if (batch.writer() != 0 && batch.batch() == 0)
    return malformed_update("batch", "must be given with writer: 1 for its first batch, then 2, 3 and so on");
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<UpdateBatch> to_updates(const v1::UpdateBatch& batch) {
  RETURN_IF_ERROR(check_batch_form(batch));
  UpdateBatch out;
  out.frame = to_vec(batch.frame());
  if (batch.has_tick()) out.tick = batch.tick();
  out.clear = batch.clear();
  out.remove_ids = span_of(batch.remove_ids());
  out.remove_groups = span_of(batch.remove_groups());
  for (int i = 0; i < batch.inserts_size(); ++i) {
    ASSIGN_OR_RETURN(InsertColumns insert, to_insert(batch.inserts(i), absl::StrCat("inserts[", i, "]")));
    out.inserts.push_back(std::move(insert));
  }
  for (int i = 0; i < batch.moves_size(); ++i) {
    ASSIGN_OR_RETURN(MoveColumns move, to_move(batch.moves(i), absl::StrCat("moves[", i, "]")));
    out.moves.push_back(move);
  }
  for (const v1::Relabel& relabel : batch.relabels()) out.relabels.push_back(to_relabel(relabel));
  for (int i = 0; i < batch.instance_moves_size(); ++i) {
    const std::string field = absl::StrCat("instance_moves[", i, "]");
    ASSIGN_OR_RETURN(InstanceMoveColumns move, to_instance_move(batch.instance_moves(i), field));
    out.instance_moves.push_back(move);
  }
  for (const v1::Relabel& relabel : batch.instance_relabels()) out.instance_relabels.push_back(to_relabel(relabel));
  out.upsert = batch.upsert();
  out.all_or_nothing = batch.all_or_nothing();
  out.restart_ticks = batch.restart_ticks();
  out.writer = batch.writer();
  out.batch = batch.batch();
  out.lease_ms = batch.lease_ms();
  return out;
}

v1::UpdateAck to_proto(const UpdateAck& ack) {
  v1::UpdateAck out;
  out.set_epoch(ack.epoch);
  out.set_revision(ack.revision);
  out.set_tick(ack.tick);
  out.set_applied(ack.applied);
  out.set_refused(ack.refused);
  out.set_duplicate(ack.duplicate);
  for (const ItemError& error : ack.errors) {
    v1::ItemError* item = out.add_errors();
    item->set_field(error.field);
    item->set_index(error.index);
    item->set_id(error.id);
    item->set_reason(static_cast<v1::Reason>(error.reason));
    item->set_message(error.message);
  }
  return out;
}

}  // namespace locus::server
