#include "core/scene/updates/instance_applier.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/column.h"
#include "core/base/limits.h"

namespace locus {

void InstanceApplier::run() {
  LOCUS_DCHECK(check_form(batch_).ok() && instances_.empty());
  for (const UpdateBatch& message : batch_.earlier) {
    apply(message);
    ++message_index_;
  }
  apply(batch_);
}

void InstanceApplier::apply(const UpdateBatch& message) {
  message_ = &message;
  size_t items = 0;
  for (const InstanceMoveColumns& move : message.instance_moves) items += move.ids.size();
  instances_.reserve(std::min(std::max(items, instances_.capacity()), statics_.size()));
  for (size_t i = 0; i < message.instance_moves.size(); ++i)
    move(message.instance_moves[i], absl::StrCat("instance_moves[", i, "]"));
  for (size_t i = 0; i < message.instance_relabels.size(); ++i)
    relabel(message.instance_relabels[i], absl::StrCat("instance_relabels[", i, "]"));
}

std::vector<Instance> InstanceApplier::changed() {
  std::erase_if(instances_,
                [this](const Instance& instance) { return is_same(instance, *statics_.find(instance.id)); });
  return std::move(instances_);
}

Instance* InstanceApplier::find(Id id) {
  const auto [found, is_new] = indices_.try_emplace(id, instances_.size());
  if (!is_new) return &instances_[found->second];
  const Instance* const known = statics_.find(id);
  if (known != nullptr) return &instances_.emplace_back(*known);
  indices_.erase(found);
  return nullptr;
}

void InstanceApplier::refuse(std::string field, size_t index, Id id, Reason reason) {
  ++refused_;
  if (errors_.size() < limits::kMaxListedItemErrors)
    errors_.push_back({std::move(field), static_cast<uint32_t>(index), id, reason, message_index_});
}

Reason InstanceApplier::read_transform(const InstanceMoveColumns& columns, const PoseReader& poses, size_t i,
                                       Instance& instance, const char*& column) const {
  Transform to = instance.transform;
  column = poses.position_column();
  if (const Reason reason = poses.read_position(i, to.translation); reason != Reason::kUnspecified) return reason;
  if (poses.has_rotations()) {
    column = PoseReader::kRotationColumn;
    if (const Reason reason = poses.read_rotation(i, to.quaternion); reason != Reason::kUnspecified) return reason;
  }
  if (!columns.scales.empty()) {
    column = "scales";
    to.scale = ColumnReader<float>(columns.scales, 1).value(i, to.scale);
    if (!std::isfinite(to.scale)) return Reason::kNotFinite;
    if (!(to.scale >= limits::kMinScale && to.scale <= limits::kMaxScale)) return Reason::kOutOfRange;
  }
  to = make_transform(to.translation, to.quaternion, to.scale);
  return place_at(to, instance) ? Reason::kUnspecified : Reason::kOutOfRange;
}

void InstanceApplier::move(const InstanceMoveColumns& columns, const std::string& field) {
  const PoseReader poses(message_->frame, columns.positions, columns.positions_f64, columns.rotations);
  for (size_t i = 0; i < columns.ids.size(); ++i) {
    const Id id = columns.ids[i];
    Instance* const instance = find(id);
    if (instance == nullptr) {
      refuse(field + ".ids", i, id, Reason::kUnknownId);
      continue;
    }
    const char* column = nullptr;
    if (const Reason reason = read_transform(columns, poses, i, *instance, column); reason != Reason::kUnspecified) {
      refuse(absl::StrCat(field, ".", column), i, id, reason);
      continue;
    }
    if (columns.teleport && track_lifetimes_ == TrackLifetimes::kYes) instance->life = new_life();
    ++applied_;
  }
}

void InstanceApplier::relabel(const RelabelColumns& columns, const std::string& field) {
  for (size_t i = 0; i < columns.ids.size(); ++i) {
    Instance* const instance = find(columns.ids[i]);
    if (instance == nullptr) {
      refuse(field + ".ids", i, columns.ids[i], Reason::kUnknownId);
      continue;
    }
    instance->layers = ColumnReader<uint32_t>(columns.layers, 1).value(i, instance->layers);
    instance->group = ColumnReader<uint64_t>(columns.groups, 1).value(i, instance->group);
    instance->tag = ColumnReader<uint64_t>(columns.tags, 1).value(i, instance->tag);
    ++applied_;
  }
}

}  // namespace locus
