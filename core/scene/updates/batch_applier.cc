#include "core/scene/updates/batch_applier.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/column.h"
#include "core/base/limits.h"

namespace locus {
namespace {

// Returns kUnspecified if all values are finite and within [min, kMaxCoordinate], otherwise the reason of a refusal.
Reason check_values(const float* values, size_t count, float min) {
  for (size_t i = 0; i < count; ++i) {
    if (!std::isfinite(values[i])) return Reason::kNotFinite;
    if (values[i] < min || values[i] > limits::kMaxCoordinate) return Reason::kOutOfRange;
  }
  return Reason::kUnspecified;
}

Vec3f point(const float* p) { return {p[0], p[1], p[2]}; }

Reason read_part_position(const float* position, Part& part) {
  const Reason reason = check_values(position, 3, -static_cast<float>(limits::kMaxCoordinate));
  if (reason == Reason::kUnspecified) part.position = point(position);
  return reason;
}

template <class Columns>
void read_labels(const Columns& columns, size_t i, Object& object) {
  object.layers = ColumnReader<uint32_t>(columns.layers, 1).value(i, object.layers);
  object.group = ColumnReader<uint64_t>(columns.groups, 1).value(i, object.group);
  object.tag = ColumnReader<uint64_t>(columns.tags, 1).value(i, object.tag);
}

}  // namespace

BatchApplier::BatchApplier(const ObjectStore& objects, const StaticSet& statics, const UpdateBatch& batch,
                           TrackLifetimes track_lifetimes)
    : objects_(objects),
      statics_(statics),
      batch_(batch),
      track_lifetimes_(track_lifetimes),
      message_(&batch),
      count_(objects.size()) {
  LOCUS_DCHECK(check_form(batch).ok());
}

void BatchApplier::remove_first(Id id) {
  LOCUS_DCHECK(current(id).has_value());
  remove(id);
}

void BatchApplier::run() {
  LOCUS_DCHECK(applied_ == 0 && refused_ == 0 && message_index_ == 0);  // called once
  for (const UpdateBatch& message : batch_.earlier) {
    apply(message);
    ++message_index_;
  }
  apply(batch_);
  LOCUS_DCHECK_LE(errors_.size(), size_t{refused_});
}

void BatchApplier::apply(const UpdateBatch& message) {
  message_ = &message;
  if (message.clear) clear();
  remove_ids();
  remove_groups();
  for (size_t i = 0; i < message.inserts.size(); ++i) insert(message.inserts[i], absl::StrCat("inserts[", i, "]"));
  for (size_t i = 0; i < message.moves.size(); ++i) move(message.moves[i], absl::StrCat("moves[", i, "]"));
  for (size_t i = 0; i < message.relabels.size(); ++i) relabel(message.relabels[i], absl::StrCat("relabels[", i, "]"));
}

void BatchApplier::clear() {
  cleared_ = true;
  count_ = 0;
  changed_.clear();
  inserted_.clear();
  grouped_.clear();
}

std::optional<Object> BatchApplier::current(Id id) const {
  const auto changed = changed_.find(id);
  if (changed != changed_.end()) return changed->second;
  return cleared_ ? std::nullopt : objects_.find(id);
}

void BatchApplier::put(const Object& object) {
  changed_[object.id] = object;
  if (object.group != 0 && !batch_.earlier.empty()) grouped_[object.group].push_back(object.id);
}

void BatchApplier::remove(Id id) {
  changed_[id] = std::nullopt;
  inserted_.erase(id);
  --count_;
}

void BatchApplier::refuse(std::string field, size_t index, Id id, Reason reason) {
  ++refused_;
  if (errors_.size() < limits::kMaxListedItemErrors)
    errors_.push_back({std::move(field), static_cast<uint32_t>(index), id, reason, message_index_});
}

void BatchApplier::remove_ids() {
  for (size_t i = 0; i < message_->remove_ids.size(); ++i) {
    const Id id = message_->remove_ids[i];
    if (!current(id)) {
      refuse("remove_ids", i, id, Reason::kUnknownId);
      continue;
    }
    remove(id);
    ++applied_;
  }
}

void BatchApplier::remove_groups() {
  absl::flat_hash_set<Group> groups;
  for (size_t i = 0; i < message_->remove_groups.size(); ++i) {
    if (message_->remove_groups[i] == 0) {
      refuse("remove_groups", i, kNoId, Reason::kOutOfRange);
      continue;
    }
    groups.insert(message_->remove_groups[i]);
    ++applied_;
  }
  for (const Group group : groups) {
    const auto remove_member = [this, group](Id id) {
      const std::optional<Object> now = current(id);
      if (now && now->group == group) remove(id);
    };
    if (const auto grouped = grouped_.extract(group); !grouped.empty())
      for (const Id id : grouped.mapped()) remove_member(id);
    if (!cleared_) objects_.for_each_in(group, [&](const Object& object) { remove_member(object.id); });
  }
}

bool BatchApplier::read_pose(const PoseReader& poses, uint32_t index, Id id, const std::string& field, Shape& shape) {
  if (const Reason reason = poses.read_position(index, shape.position); reason != Reason::kUnspecified) {
    refuse(absl::StrCat(field, ".", poses.position_column()), index, id, reason);
    return false;
  }
  if (!poses.has_rotations()) return true;
  if (const Reason reason = poses.read_rotation(index, shape.rotation); reason != Reason::kUnspecified) {
    refuse(absl::StrCat(field, ".", PoseReader::kRotationColumn), index, id, reason);
    return false;
  }
  return true;
}

bool BatchApplier::refuse_fault(const Fault& fault, uint32_t index, Id id, const std::string& field) {
  if (fault.reason == Reason::kUnspecified) return false;
  refuse(absl::StrCat(field, ".", fault.column), index, id, fault.reason);
  return true;
}

template <class Columns>
BatchApplier::Fault BatchApplier::read_size(const Columns& columns, size_t index, Shape& shape) {
  shape.kind = columns.kind;
  const bool capsule = columns.kind == ShapeKind::kCapsule;
  if (columns.kind == ShapeKind::kBall || capsule) {
    shape.radius = ColumnReader<float>(columns.radii, 1).value(index, 0);
    if (const Reason reason = check_values(&shape.radius, 1, 0); reason != Reason::kUnspecified)
      return {capsule ? "capsule.radii" : "ball.radii", reason};
  }
  if (columns.kind != ShapeKind::kBox && !capsule) return {};
  const float* extents = ColumnReader<float>(columns.extents, 3).entry(index);
  const float min = capsule ? -static_cast<float>(limits::kMaxCoordinate) : 0;
  if (const Reason reason = check_values(extents, 3, min); reason != Reason::kUnspecified)
    return {capsule ? "capsule.half_axes" : "box.half_extents", reason};
  shape.size = point(extents);
  return {};
}

BatchApplier::Fault BatchApplier::read_part(const PartColumns& columns, size_t index, Part& part) {
  Shape shape;
  if (Fault fault = read_size(columns, index, shape); fault.reason != Reason::kUnspecified) return fault;
  part = {shape.kind, {},           {},
          shape.size, shape.radius, ColumnReader<uint32_t>(columns.layers, 1).value(index, kAllLayers)};
  if (const Reason reason = read_part_position(&columns.positions[3 * index], part); reason != Reason::kUnspecified)
    return {"positions", reason};
  if (columns.rotations.empty()) return {};
  const float* const rotation = ColumnReader<float>(columns.rotations, 4).entry(index);
  if (const Reason reason = read_quaternion(rotation, part.rotation); reason != Reason::kUnspecified)
    return {PoseReader::kRotationColumn, reason};
  return {};
}

const Compound* BatchApplier::keep(std::vector<Part> parts) {
  compounds_.push_back(Compound::make(std::move(parts)));
  return compounds_.back().get();
}

const Compound* BatchApplier::read_compound(const InsertColumns& columns, Fault& fault) {
  std::vector<Part> parts;
  parts.reserve(part_count(columns));
  for (size_t i = 0; i < columns.parts.size(); ++i) {
    for (size_t k = 0; k < columns.parts[i].count(); ++k) {
      fault = read_part(columns.parts[i], k, parts.emplace_back());
      if (fault.reason == Reason::kUnspecified) continue;
      fault.column = absl::StrCat("compound.parts[", i, "].", fault.column);
      return nullptr;
    }
  }
  return keep(std::move(parts));
}

BatchApplier::Fault BatchApplier::read_part_poses(const MoveColumns& columns, size_t index, Object& object) {
  const size_t count = columns.parts_each;
  if (object.compound == nullptr || object.compound->parts().size() != count)
    return {"parts_each", Reason::kOutOfRange};
  std::vector<Part> parts = object.compound->parts();
  if (!columns.part_positions.empty()) {
    const float* const positions = ColumnReader<float>(columns.part_positions, 3 * count).entry(index);
    for (size_t k = 0; k < count; ++k)
      if (const Reason reason = read_part_position(positions + 3 * k, parts[k]); reason != Reason::kUnspecified)
        return {"part_positions", reason};
  }
  if (!columns.part_rotations.empty()) {
    const float* const rotations = ColumnReader<float>(columns.part_rotations, 4 * count).entry(index);
    for (size_t k = 0; k < count; ++k)
      if (const Reason reason = read_quaternion(rotations + 4 * k, parts[k].rotation); reason != Reason::kUnspecified)
        return {"part_rotations", reason};
  }
  if (parts != object.compound->parts()) object.compound = keep(std::move(parts));
  return {};
}

bool BatchApplier::may_insert(Id id, uint32_t index, const std::string& field) {
  Reason reason = Reason::kUnspecified;
  const bool known = current(id).has_value();
  if (id == kNoId) reason = Reason::kOutOfRange;
  if (statics_.find(id) != nullptr || (known && !message_->upsert)) reason = Reason::kDuplicateId;
  if (reason != Reason::kUnspecified) refuse(field + ".ids", index, id, reason);
  return reason == Reason::kUnspecified;
}

void BatchApplier::insert(const InsertColumns& columns, const std::string& field) {
  const PoseReader poses(message_->frame, columns.positions, columns.positions_f64, columns.rotations);
  const Compound* compound = nullptr;
  Fault parts_fault;
  Layers layers = kDefaultLayers;
  if (columns.kind == ShapeKind::kCompound && !columns.ids.empty()) {
    compound = read_compound(columns, parts_fault);
    const bool parts_have_layers = std::any_of(columns.parts.begin(), columns.parts.end(),
                                               [](const PartColumns& parts) { return !parts.layers.empty(); });
    if (compound != nullptr && parts_have_layers) layers = compound->layers();
  }
  for (uint32_t i = 0; i < columns.ids.size(); ++i) {
    Object object;
    object.id = columns.ids[i];
    object.layers = layers;
    object.compound = compound;
    if (!may_insert(object.id, i, field)) continue;
    if (!read_pose(poses, i, object.id, field, object.shape)) continue;
    if (refuse_fault(parts_fault, i, object.id, field)) continue;
    if (refuse_fault(read_size(columns, i, object.shape), i, object.id, field)) continue;
    const uint64_t expire_ticks = ColumnReader<uint64_t>(columns.expire_ticks, 1).value(i, 0);
    if (expire_ticks > limits::kMaxExpireTicks) {
      refuse(field + ".expire_ticks", i, object.id, Reason::kOutOfRange);
      continue;
    }
    read_labels(columns, i, object);
    if (!current(object.id)) {
      ++count_;
      begin_life(object.id);
    }
    put(object);
    if (records_inserted_) inserted_[object.id] = expire_ticks;
    ++applied_;
  }
}

void BatchApplier::move(const MoveColumns& columns, const std::string& field) {
  const PoseReader poses(message_->frame, columns.positions, columns.positions_f64, columns.rotations);
  for (uint32_t i = 0; i < columns.ids.size(); ++i) {
    const Id id = columns.ids[i];
    const std::optional<Object> known = current(id);
    if (!known) {
      refuse(field + ".ids", i, id, Reason::kUnknownId);
      continue;
    }
    Object object = *known;
    if (!read_pose(poses, i, id, field, object.shape)) continue;
    if (columns.parts_each != 0 && refuse_fault(read_part_poses(columns, i, object), i, id, field)) continue;
    if (columns.teleport) begin_life(id);
    put(object);
    ++applied_;
  }
}

void BatchApplier::relabel(const RelabelColumns& columns, const std::string& field) {
  for (uint32_t i = 0; i < columns.ids.size(); ++i) {
    const std::optional<Object> known = current(columns.ids[i]);
    if (!known) {
      refuse(field + ".ids", i, columns.ids[i], Reason::kUnknownId);
      continue;
    }
    Object object = *known;
    read_labels(columns, i, object);
    put(object);
    ++applied_;
  }
}

BatchApplier::Difference BatchApplier::difference() {
  Difference difference;
  difference.replaced = std::move(replaced_);
  const auto lives_on = [&difference](const Object& before, const std::optional<Object>& now) {
    return now && *now == before && !difference.replaced.contains(before.id);
  };
  if (cleared_)
    objects_.for_each([&](const Object& object) {
      const auto changed = changed_.find(object.id);
      if (changed == changed_.end() || !lives_on(object, changed->second)) difference.removed.push_back(object);
    });
  for (const auto& [id, object] : changed_) {
    const std::optional<Object> before = objects_.find(id);
    if (before && lives_on(*before, object)) continue;
    if (before && !cleared_) difference.removed.push_back(*before);
    if (object) difference.added.push_back(*object);
  }
  LOCUS_DCHECK_EQ(count_ + difference.removed.size(), objects_.size() + difference.added.size());
  return difference;
}

}  // namespace locus
