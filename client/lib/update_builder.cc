#include "client/lib/update_builder.h"

#include <utility>

#include "client/lib/columns.h"
#include "google/protobuf/util/message_differencer.h"

namespace locus::client {
namespace {

constexpr uint32_t kDefaultLayers = 1;

template <class Message>
void append_position(Message& message, const Position& position) {
  const Double3& value = position.value;
  if (position.absolute) return append_triple(*message.mutable_positions_f64(), value);
  append_triple(*message.mutable_positions(),
                {static_cast<float>(value.x), static_cast<float>(value.y), static_cast<float>(value.z)});
}

template <class Move>
bool continues(const Move& last, bool absolute, bool rotated, MoveKind kind) {
  return (last.positions_f64_size() > 0) == absolute && (last.rotations_size() > 0) == rotated &&
         last.teleport() == (kind == MoveKind::kTeleport);
}

// Returns whether a row may be added to the last entry of compounds: all objects of an entry have the same parts, and
// either all or none of them have layers.
bool continues(const v1::Insert& last, const Compound& compound, const Labels& labels) {
  return (last.layers_size() > 0) == labels.layers.has_value() &&
         google::protobuf::util::MessageDifferencer::Equals(last.compound(), compound.message());
}

bool continues(const v1::Relabel& last, const Relabeling& labels) {
  return (last.layers_size() > 0) == labels.layers.has_value() &&
         (last.groups_size() > 0) == labels.group.has_value() && (last.tags_size() > 0) == labels.tag.has_value();
}

// Appends a row to the last message of `relabels`, or to a new message if the last one sets other kinds of labels.
void append_relabel(google::protobuf::RepeatedPtrField<v1::Relabel>& relabels, uint64_t id, const Relabeling& labels) {
  const bool same = !relabels.empty() && continues(relabels[relabels.size() - 1], labels);
  v1::Relabel& relabel = same ? relabels[relabels.size() - 1] : *relabels.Add();
  relabel.add_ids(id);
  if (labels.layers) relabel.add_layers(*labels.layers);
  if (labels.group) relabel.add_groups(*labels.group);
  if (labels.tag) relabel.add_tags(*labels.tag);
}

}  // namespace

UpdateBuilder& UpdateBuilder::frame(const Double3& origin) {
  v1::Vec3d& frame = *batch_.mutable_frame();
  frame.set_x(origin.x);
  frame.set_y(origin.y);
  frame.set_z(origin.z);
  return *this;
}

UpdateBuilder& UpdateBuilder::tick(uint64_t tick) {
  batch_.set_tick(tick);
  return *this;
}

UpdateBuilder& UpdateBuilder::upsert() {
  batch_.set_upsert(true);
  return *this;
}

UpdateBuilder& UpdateBuilder::all_or_nothing() {
  batch_.set_all_or_nothing(true);
  return *this;
}

UpdateBuilder& UpdateBuilder::restart_ticks() {
  batch_.set_restart_ticks(true);
  return *this;
}

UpdateBuilder& UpdateBuilder::clear() {
  batch_.set_clear(true);
  return *this;
}

UpdateBuilder& UpdateBuilder::remove(uint64_t id) {
  batch_.add_remove_ids(id);
  return *this;
}

UpdateBuilder& UpdateBuilder::remove(absl::Span<const uint64_t> ids) {
  batch_.mutable_remove_ids()->Add(ids.begin(), ids.end());
  return *this;
}

UpdateBuilder& UpdateBuilder::remove_group(uint64_t group) {
  batch_.add_remove_groups(group);
  return *this;
}

size_t UpdateBuilder::slot_of(Form form, const Position& position) {
  return static_cast<size_t>(form) * 2 + (position.absolute ? 1 : 0);
}

v1::Insert& UpdateBuilder::add_row(Form form, uint64_t id, const Position& position, const Rotation& rotation,
                                   const Labels& labels) {
  const size_t slot = slot_of(form, position);
  if (row_inserts_[slot] < 0) {
    row_inserts_[slot] = batch_.inserts_size();
    batch_.add_inserts();
  }
  v1::Insert& insert = *batch_.mutable_inserts(row_inserts_[slot]);
  const int rows_before = insert.ids_size();
  insert.add_ids(id);
  append_position(insert, position);
  append_rotation_row(*insert.mutable_rotations(), rows_before, rotation);
  if (form == Form::kCompound) {
    if (labels.layers) insert.add_layers(*labels.layers);
  } else {
    append_row<uint32_t>(*insert.mutable_layers(), rows_before, labels.layers.value_or(kDefaultLayers), kDefaultLayers);
  }
  append_row<uint64_t>(*insert.mutable_groups(), rows_before, labels.group, 0);
  append_row<uint64_t>(*insert.mutable_tags(), rows_before, labels.tag, 0);
  append_row<uint64_t>(*insert.mutable_expire_ticks(), rows_before, labels.expire_ticks, 0);
  return insert;
}

UpdateBuilder& UpdateBuilder::insert_point(uint64_t id, const Position& position, const Labels& labels) {
  add_row(Form::kPoint, id, position, {}, labels).mutable_point();
  return *this;
}

UpdateBuilder& UpdateBuilder::insert_ball(uint64_t id, const Position& position, float radius, const Labels& labels) {
  add_row(Form::kBall, id, position, {}, labels).mutable_ball()->add_radii(radius);
  return *this;
}

UpdateBuilder& UpdateBuilder::insert_box(uint64_t id, const Position& position, const Float3& half_extents,
                                         const Rotation& rotation, const Labels& labels) {
  v1::Box& box = *add_row(Form::kBox, id, position, rotation, labels).mutable_box();
  append_triple(*box.mutable_half_extents(), half_extents);
  return *this;
}

UpdateBuilder& UpdateBuilder::insert_capsule(uint64_t id, const Position& position, const Float3& half_axis,
                                             float radius, const Rotation& rotation, const Labels& labels) {
  v1::Capsule& capsule = *add_row(Form::kCapsule, id, position, rotation, labels).mutable_capsule();
  append_triple(*capsule.mutable_half_axes(), half_axis);
  capsule.add_radii(radius);
  return *this;
}

UpdateBuilder& UpdateBuilder::insert_compound(uint64_t id, const Position& position, const Compound& compound,
                                              const Rotation& rotation, const Labels& labels) {
  int& entry = row_inserts_[slot_of(Form::kCompound, position)];
  if (entry >= 0 && !continues(batch_.inserts(entry), compound, labels)) entry = -1;
  v1::Insert& insert = add_row(Form::kCompound, id, position, rotation, labels);
  if (!insert.has_compound()) *insert.mutable_compound() = compound.message();
  return *this;
}

v1::Insert& UpdateBuilder::add_columns(const InsertColumns& columns) {
  v1::Insert& insert = *batch_.add_inserts();
  assign(*insert.mutable_ids(), columns.ids);
  assign(*insert.mutable_positions(), columns.positions);
  assign(*insert.mutable_positions_f64(), columns.positions_f64);
  assign(*insert.mutable_rotations(), columns.rotations);
  assign(*insert.mutable_layers(), columns.layers);
  assign(*insert.mutable_groups(), columns.groups);
  assign(*insert.mutable_tags(), columns.tags);
  assign(*insert.mutable_expire_ticks(), columns.expire_ticks);
  return insert;
}

UpdateBuilder& UpdateBuilder::insert_points(const InsertColumns& columns) {
  add_columns(columns).mutable_point();
  return *this;
}

UpdateBuilder& UpdateBuilder::insert_balls(const InsertColumns& columns, absl::Span<const float> radii) {
  assign(*add_columns(columns).mutable_ball()->mutable_radii(), radii);
  return *this;
}

UpdateBuilder& UpdateBuilder::insert_boxes(const InsertColumns& columns, absl::Span<const float> half_extents) {
  assign(*add_columns(columns).mutable_box()->mutable_half_extents(), half_extents);
  return *this;
}

UpdateBuilder& UpdateBuilder::insert_capsules(const InsertColumns& columns, absl::Span<const float> half_axes,
                                              absl::Span<const float> radii) {
  v1::Capsule& capsule = *add_columns(columns).mutable_capsule();
  assign(*capsule.mutable_half_axes(), half_axes);
  assign(*capsule.mutable_radii(), radii);
  return *this;
}

UpdateBuilder& UpdateBuilder::insert_compounds(const InsertColumns& columns, const Compound& compound) {
  *add_columns(columns).mutable_compound() = compound.message();
  return *this;
}

v1::Move& UpdateBuilder::add_move(uint64_t id, const Position& position, const std::optional<Rotation>& rotation,
                                  size_t parts, MoveKind kind) {
  const int entries = batch_.moves_size();
  const bool same = move_takes_rows_ && batch_.moves(entries - 1).parts_each() == parts &&
                    continues(batch_.moves(entries - 1), position.absolute, rotation.has_value(), kind);
  v1::Move& move = same ? *batch_.mutable_moves(entries - 1) : *batch_.add_moves();
  move.add_ids(id);
  append_position(move, position);
  if (rotation) append_rotation(*move.mutable_rotations(), *rotation);
  move.set_parts_each(static_cast<uint32_t>(parts));
  move.set_teleport(kind == MoveKind::kTeleport);
  move_takes_rows_ = true;
  return move;
}

UpdateBuilder& UpdateBuilder::move(uint64_t id, const Position& position, const std::optional<Rotation>& rotation,
                                   MoveKind kind) {
  add_move(id, position, rotation, 0, kind);
  return *this;
}

UpdateBuilder& UpdateBuilder::move_compound(uint64_t id, const Position& position, absl::Span<const PartPose> parts,
                                            const std::optional<Rotation>& rotation, MoveKind kind) {
  v1::Move& move = add_move(id, position, rotation, parts.size(), kind);
  for (const PartPose& part : parts) {
    append_triple(*move.mutable_part_positions(), part.position);
    append_rotation(*move.mutable_part_rotations(), part.rotation);
  }
  return *this;
}

UpdateBuilder& UpdateBuilder::moves(const MoveColumns& columns, MoveKind kind) {
  v1::Move& move = *batch_.add_moves();
  assign(*move.mutable_ids(), columns.ids);
  assign(*move.mutable_positions(), columns.positions);
  assign(*move.mutable_positions_f64(), columns.positions_f64);
  assign(*move.mutable_rotations(), columns.rotations);
  move.set_parts_each(columns.parts_each);
  assign(*move.mutable_part_positions(), columns.part_positions);
  assign(*move.mutable_part_rotations(), columns.part_rotations);
  move.set_teleport(kind == MoveKind::kTeleport);
  move_takes_rows_ = false;
  return *this;
}

UpdateBuilder& UpdateBuilder::relabel(uint64_t id, const Relabeling& labels) {
  append_relabel(*batch_.mutable_relabels(), id, labels);
  return *this;
}

UpdateBuilder& UpdateBuilder::move_instance(uint64_t id, const Position& position,
                                            const std::optional<Rotation>& rotation, std::optional<float> scale,
                                            MoveKind kind) {
  const int entries = batch_.instance_moves_size();
  const auto takes_row = [&](const v1::InstanceMove& last) {
    return continues(last, position.absolute, rotation.has_value(), kind) &&
           (last.scales_size() > 0) == scale.has_value();
  };
  const bool same = instance_move_takes_rows_ && takes_row(batch_.instance_moves(entries - 1));
  v1::InstanceMove& move = same ? *batch_.mutable_instance_moves(entries - 1) : *batch_.add_instance_moves();
  move.add_ids(id);
  append_position(move, position);
  if (rotation) append_rotation(*move.mutable_rotations(), *rotation);
  if (scale) move.add_scales(*scale);
  move.set_teleport(kind == MoveKind::kTeleport);
  instance_move_takes_rows_ = true;
  return *this;
}

UpdateBuilder& UpdateBuilder::move_instances(const InstanceMoveColumns& columns, MoveKind kind) {
  v1::InstanceMove& move = *batch_.add_instance_moves();
  assign(*move.mutable_ids(), columns.ids);
  assign(*move.mutable_positions(), columns.positions);
  assign(*move.mutable_positions_f64(), columns.positions_f64);
  assign(*move.mutable_rotations(), columns.rotations);
  assign(*move.mutable_scales(), columns.scales);
  move.set_teleport(kind == MoveKind::kTeleport);
  instance_move_takes_rows_ = false;
  return *this;
}

UpdateBuilder& UpdateBuilder::relabel_instance(uint64_t id, const Relabeling& labels) {
  append_relabel(*batch_.mutable_instance_relabels(), id, labels);
  return *this;
}

v1::UpdateBatch UpdateBuilder::build() {
  row_inserts_.fill(-1);
  move_takes_rows_ = false;
  instance_move_takes_rows_ = false;
  return std::exchange(batch_, v1::UpdateBatch());
}

}  // namespace locus::client
