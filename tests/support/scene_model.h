// Reference of the random tests for the semantics of update batches: applies one item after the other to a std::map.
// The reference has no index and shares no data between states. For a scene with history it keeps a complete copy of
// every tick.
#ifndef LOCUS_TESTS_SUPPORT_SCENE_MODEL_H_
#define LOCUS_TESTS_SUPPORT_SCENE_MODEL_H_

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/objects/object.h"
#include "core/scene/updates/update_batch.h"

namespace locus::test {

class SceneModel {
 public:
  using Objects = std::map<Id, Object>;

  struct Outcome {
    absl::StatusCode code = absl::StatusCode::kOk;
    UpdateAck ack;    // ack, if `code` is OK
    ItemError error;  // reason, field and index of a refusal
  };

  // Makes an empty model. `history_ticks` has the meaning of HistoryOptions::ticks.
  explicit SceneModel(uint64_t history_ticks = 0) : history_ticks_(history_ticks) {}

  const Objects& objects() const { return objects_; }
  uint64_t tick() const { return tick_; }
  uint64_t oldest_tick() const { return past_.empty() ? tick_ : past_.begin()->first; }
  size_t recorded_ticks() const { return past_.size(); }
  // Returns the objects at the given time, interpolated between ticks; nullopt if the history does not contain this
  // time.
  std::optional<std::vector<Object>> objects_at(uint64_t tick, float fraction) const {
    std::vector<Object> objects;
    if (tick == tick_ && fraction == 0) {
      for (const auto& [id, object] : objects_) objects.push_back(object);
      return objects;
    }
    if (tick >= tick_ || tick < oldest_tick()) return std::nullopt;
    const auto next = past_.upper_bound(tick);
    const auto& [at, then] = *std::prev(next);
    const bool last = next == past_.end();
    const double gone = static_cast<double>(tick - at) + static_cast<double>(fraction);
    const double weight = gone / static_cast<double>((last ? tick_ : next->first) - at);
    for (const auto& [id, object] : then.objects) {
      objects.push_back(object);
      const Objects& later = last ? objects_ : next->second.objects;
      const Lifetimes& lifetimes = last ? lifetimes_ : next->second.lifetimes;
      const auto life = lifetimes.find(id);
      if (gone == 0 || life == lifetimes.end() || life->second != then.lifetimes.at(id)) continue;
      Shape& shape = objects.back().shape;
      const Shape& end = later.at(id).shape;
      for (int axis = 0; axis < 3; ++axis)
        shape.position[axis] = shape.position[axis] + (end.position[axis] - shape.position[axis]) * weight;
      shape.rotation = blended(shape.rotation, end.rotation, weight);
    }
    return objects;
  }
  // Returns the position of an object at the end of the last recorded tick; nullopt if the object did not exist.
  std::optional<Vec3d> position_at_last_tick(Id id) const {
    if (past_.empty()) return std::nullopt;
    const Objects& objects = past_.rbegin()->second.objects;
    const auto known = objects.find(id);
    return known == objects.end() ? std::nullopt : std::optional<Vec3d>(known->second.shape.position);
  }
  // State of an instance.
  struct Placed {
    Shape pose;  // position and rotation
    float scale = 1;
    Layers layers = kDefaultLayers;
    Group group = 0;
    Tag tag = 0;

    friend bool operator==(const Placed&, const Placed&) = default;
  };
  using Instances = std::map<Id, Placed>;
  const Instances& instances() const { return instances_; }

  // Removes the instance `removed` (kNoId = removes none) and places an instance with the id `placed` at the origin.
  // Returns false and changes nothing if the change is refused.
  bool change_instances(Id removed, Id placed) {
    Instances next = instances_;
    if (removed != kNoId && next.erase(removed) == 0) return false;
    if (placed == kNoId || objects_.contains(placed) || !next.try_emplace(placed).second) return false;
    instances_ = std::move(next);
    ++revision_;
    return true;
  }

  // Applies a batch of valid form and returns its expected outcome.
  Outcome apply(const UpdateBatch& batch) {
    if (batch.writer != 0) {
      const auto& [number, last] = writers_[batch.writer];
      if (batch.batch > number + 1)
        return {absl::StatusCode::kFailedPrecondition, {}, {"batch", 0, kNoId, Reason::kBatchGap}};
      if (batch.batch <= number) return {absl::StatusCode::kOk, duplicate(batch.batch == number ? last : now()), {}};
    }
    ack_ = {};
    message_ = 0;
    next_ = objects_;
    next_lifetimes_ = lifetimes_;
    next_instances_ = instances_;
    next_jumps_ = false;
    next_ends_ = ends_;
    owner_ = batch.lease_ms != 0 || leases_.contains(batch.writer) ? batch.writer : 0;
    if (!batch.restart_ticks && batch.tick.value_or(0) > tick_) expire(*batch.tick - tick_);
    const Ends aged = next_ends_;
    for (const UpdateBatch& message : batch.earlier) {
      apply_items(message);
      ++message_;
    }
    apply_items(batch);
    ends_change_ = std::any_of(next_ends_.begin(), next_ends_.end(), [&aged](const auto& entry) {
      const auto before = aged.find(entry.first);
      return before != aged.end() && before->second.remaining != entry.second.remaining;
    });
    if (batch.all_or_nothing && ack_.refused > 0) return {absl::StatusCode::kInvalidArgument, {}, ack_.errors.front()};
    commit(batch);
    if (batch.lease_ms != 0) leases_[batch.writer] = batch.lease_ms;
    if (batch.writer != 0) writers_[batch.writer] = {batch.batch, ack_};
    return {absl::StatusCode::kOk, ack_, {}};
  }

  // Number of ticks until an object expires, or 0, and the writer to whose lease the object belongs, or 0.
  struct End {
    uint64_t remaining = 0;
    uint64_t owner = 0;

    friend bool operator==(const End&, const End&) = default;
  };
  using Ends = std::map<Id, End>;
  const Ends& ends() const { return ends_; }
  // Lengths of the leases, by writer.
  const std::map<uint64_t, uint32_t>& leases() const { return leases_; }

  // Ends the lease of a writer. Returns false if it has none.
  bool end_lease(uint64_t writer) {
    if (leases_.erase(writer) == 0) return false;
    const size_t before = objects_.size();
    std::erase_if(objects_, [&](const auto& entry) { return ends_.at(entry.first).owner == writer; });
    std::erase_if(ends_, [&](const auto& entry) { return !objects_.contains(entry.first); });
    std::erase_if(lifetimes_, [&](const auto& entry) { return !objects_.contains(entry.first); });
    if (objects_.size() != before) ++revision_;
    return true;
  }

 private:
  // Removes the objects that expire within `ticks` ticks.
  void expire(uint64_t ticks) {
    for (auto& [id, end] : next_ends_) {
      if (end.remaining == 0) continue;
      if (end.remaining <= ticks) next_.erase(id);
      end.remaining -= std::min(ticks, end.remaining);
    }
    forget_removed();
  }
  void forget_removed() {
    std::erase_if(next_lifetimes_, [this](const auto& life) { return !next_.contains(life.first); });
    std::erase_if(next_ends_, [this](const auto& end) { return !next_.contains(end.first); });
  }

  void commit(const UpdateBatch& batch) {
    uint64_t tick = batch.tick.value_or(tick_);
    if (!batch.restart_ticks) tick = std::max(tick, tick_);
    forget_removed();
    const bool forgets = batch.restart_ticks && !past_.empty();
    const bool replaced = history_ticks_ != 0 && next_lifetimes_ != lifetimes_;
    const bool instances_change = next_instances_ != instances_ || next_jumps_;
    if (tick != tick_ || next_ != objects_ || instances_change || forgets || replaced || ends_change_) ++revision_;
    instances_ = std::move(next_instances_);
    if (history_ticks_ != 0) remember(batch, tick);
    tick_ = tick;
    objects_ = std::move(next_);
    lifetimes_ = std::move(next_lifetimes_);
    ends_ = std::move(next_ends_);
    ack_.revision = revision_;
    ack_.tick = tick_;
  }

  void remember(const UpdateBatch& batch, uint64_t tick) {
    if (batch.restart_ticks) return past_.clear();
    if (tick == tick_) return;
    past_[tick_] = {objects_, lifetimes_};
    while (past_.size() > 1 && tick >= history_ticks_ && std::next(past_.begin())->first <= tick - history_ticks_)
      past_.erase(past_.begin());
  }

  UpdateAck now() const {
    UpdateAck ack;
    ack.revision = revision_;
    ack.tick = tick_;
    return ack;
  }
  static UpdateAck duplicate(UpdateAck ack) {
    ack.duplicate = true;
    return ack;
  }

  void apply_items(const UpdateBatch& batch) {
    if (batch.clear) next_.clear();
    for (size_t i = 0; i < batch.remove_ids.size(); ++i) {
      const Id id = batch.remove_ids[i];
      count(next_.erase(id) == 1 ? Reason::kUnspecified : Reason::kUnknownId, "remove_ids", i, id);
    }
    for (size_t i = 0; i < batch.remove_groups.size(); ++i) {
      const Group group = batch.remove_groups[i];
      if (group != 0) std::erase_if(next_, [group](const auto& entry) { return entry.second.group == group; });
      count(group == 0 ? Reason::kOutOfRange : Reason::kUnspecified, "remove_groups", i, kNoId);
    }
    forget_removed();
    for (size_t list = 0; list < batch.inserts.size(); ++list)
      for (size_t i = 0; i < batch.inserts[list].ids.size(); ++i)
        insert(batch, batch.inserts[list], i, "inserts[" + std::to_string(list) + "]");
    for (size_t list = 0; list < batch.moves.size(); ++list)
      for (size_t i = 0; i < batch.moves[list].ids.size(); ++i)
        move(batch, batch.moves[list], i, "moves[" + std::to_string(list) + "]");
    for (size_t list = 0; list < batch.relabels.size(); ++list)
      for (size_t i = 0; i < batch.relabels[list].ids.size(); ++i)
        relabel(batch.relabels[list], i, "relabels[" + std::to_string(list) + "]");
    for (size_t list = 0; list < batch.instance_moves.size(); ++list)
      for (size_t i = 0; i < batch.instance_moves[list].ids.size(); ++i)
        move_instance(batch, batch.instance_moves[list], i, "instance_moves[" + std::to_string(list) + "]");
    for (size_t list = 0; list < batch.instance_relabels.size(); ++list)
      for (size_t i = 0; i < batch.instance_relabels[list].ids.size(); ++i)
        relabel_instance(batch.instance_relabels[list], i, "instance_relabels[" + std::to_string(list) + "]");
  }

  void count(Reason reason, const std::string& field, size_t index, Id id) {
    if (reason == Reason::kUnspecified) {
      ++ack_.applied;
      return;
    }
    ++ack_.refused;
    if (ack_.errors.size() < 1000) ack_.errors.push_back({field, static_cast<uint32_t>(index), id, reason, message_});
  }

  template <class T>
  static const T* entry(absl::Span<const T> column, size_t width, size_t i) {
    return column.data() + (column.size() == width ? 0 : width * i);
  }

  template <class T>
  static Reason judge(const T* numbers, size_t count, double lowest) {
    for (size_t i = 0; i < count; ++i) {
      if (!std::isfinite(numbers[i])) return Reason::kNotFinite;
      if (numbers[i] < lowest || numbers[i] > 1e9) return Reason::kOutOfRange;
    }
    return Reason::kUnspecified;
  }

  // Path of the field that is wrong (empty if no field is wrong), and the reason of the refusal.
  using Fault = std::pair<std::string, Reason>;

  template <class T>
  static Fault read_pose(const UpdateBatch& batch, const T& columns, size_t i, Shape& shape) {
    const bool absolute = !columns.positions_f64.empty();
    for (int axis = 0; axis < 3; ++axis)
      shape.position[axis] = absolute ? entry(columns.positions_f64, 3, i)[axis]
                                      : batch.frame[axis] + static_cast<double>(entry(columns.positions, 3, i)[axis]);
    const double numbers[] = {shape.position.x, shape.position.y, shape.position.z};
    if (!is_finite(shape.position)) return {absolute ? ".positions_f64" : ".positions", Reason::kNotFinite};
    if (const Reason reason = judge(numbers, 3, -1e9); reason != Reason::kUnspecified)
      return {absolute ? ".positions_f64" : ".positions", reason};
    if (columns.rotations.empty()) return {};
    const float* q = entry(columns.rotations, 4, i);
    const double length =
        std::sqrt(double{q[0]} * q[0] + double{q[1]} * q[1] + double{q[2]} * q[2] + double{q[3]} * q[3]);
    if (!std::isfinite(length)) return {".rotations", Reason::kNotFinite};
    if (std::abs(length - 1) > 1e-3) return {".rotations", Reason::kOutOfRange};
    shape.rotation = normalized({q[0], q[1], q[2], q[3]});
    return {};
  }

  static Fault read_shape(const InsertColumns& columns, size_t i, Shape& shape) {
    shape.kind = columns.kind;
    const bool capsule = columns.kind == ShapeKind::kCapsule;
    const std::string kind = capsule ? ".capsule" : columns.kind == ShapeKind::kBall ? ".ball" : ".box";
    if (capsule || columns.kind == ShapeKind::kBall) {
      shape.radius = *entry(columns.radii, 1, i);
      if (const Reason reason = judge(&shape.radius, 1, 0); reason != Reason::kUnspecified)
        return {kind + ".radii", reason};
    }
    if (capsule || columns.kind == ShapeKind::kBox) {
      const float* size = entry(columns.extents, 3, i);
      if (const Reason reason = judge(size, 3, capsule ? -1e9 : 0); reason != Reason::kUnspecified)
        return {kind + (capsule ? ".half_axes" : ".half_extents"), reason};
      shape.size = {size[0], size[1], size[2]};
    }
    return {};
  }

  template <class T, class Labelled>
  static void read_labels(const T& columns, size_t i, Labelled& object) {
    if (!columns.layers.empty()) object.layers = *entry(columns.layers, 1, i);
    if (!columns.groups.empty()) object.group = *entry(columns.groups, 1, i);
    if (!columns.tags.empty()) object.tag = *entry(columns.tags, 1, i);
  }

  // Reads the parts of a compound one after the other.
  Fault read_parts(const InsertColumns& columns, Object& object) {
    std::vector<Part> parts;
    bool have_layers = false;
    for (size_t list = 0; list < columns.parts.size(); ++list) {
      const PartColumns& one = columns.parts[list];
      have_layers = have_layers || !one.layers.empty();
      for (size_t k = 0; k < one.positions.size() / 3; ++k) {
        InsertColumns shapes;
        shapes.kind = one.kind;
        shapes.radii = one.radii;
        shapes.extents = one.extents;
        Shape shape;
        Fault fault = read_shape(shapes, k, shape);
        Part part{one.kind, {}, {}, shape.size, shape.radius, kAllLayers};
        if (fault.first.empty()) fault = read_part_pose(&one.positions[3 * k], nullptr, ".positions", "", part);
        if (fault.first.empty() && !one.rotations.empty())
          fault = read_part_pose(nullptr, entry(one.rotations, 4, k), "", ".rotations", part);
        if (!fault.first.empty()) return {".compound.parts[" + std::to_string(list) + "]" + fault.first, fault.second};
        if (!one.layers.empty()) part.layers = *entry(one.layers, 1, k);
        parts.push_back(part);
      }
    }
    Layers all = 0;
    for (const Part& part : parts) all |= part.layers;
    if (have_layers) object.layers = all;
    keep_parts(std::move(parts), object);
    return {};
  }
  // Reads the position or the rotation of a part; null keeps it.
  static Fault read_part_pose(const float* position, const float* q, const char* positions, const char* rotations,
                              Part& part) {
    if (position != nullptr) {
      if (const Reason reason = judge(position, 3, -1e9); reason != Reason::kUnspecified) return {positions, reason};
      part.position = {position[0], position[1], position[2]};
    }
    if (q == nullptr) return {};
    const double length =
        std::sqrt(double{q[0]} * q[0] + double{q[1]} * q[1] + double{q[2]} * q[2] + double{q[3]} * q[3]);
    if (!std::isfinite(length)) return {rotations, Reason::kNotFinite};
    if (std::abs(length - 1) > 1e-3) return {rotations, Reason::kOutOfRange};
    part.rotation = normalized({q[0], q[1], q[2], q[3]});
    return {};
  }
  void keep_parts(std::vector<Part> parts, Object& object) {
    compounds_.push_back(Compound::make(std::move(parts)));
    object.compound = compounds_.back().get();
  }
  // Gives the parts of a compound the poses of item `i`.
  Fault move_parts(const MoveColumns& columns, size_t i, Object& object) {
    const size_t count = columns.parts_each;
    if (object.compound == nullptr || object.compound->parts().size() != count)
      return {".parts_each", Reason::kOutOfRange};
    std::vector<Part> parts = object.compound->parts();
    for (size_t k = 0; k < count && !columns.part_positions.empty(); ++k) {
      const Fault fault =
          read_part_pose(entry(columns.part_positions, 3 * count, i) + 3 * k, nullptr, ".part_positions", "", parts[k]);
      if (!fault.first.empty()) return fault;
    }
    for (size_t k = 0; k < count && !columns.part_rotations.empty(); ++k) {
      const Fault fault =
          read_part_pose(nullptr, entry(columns.part_rotations, 4 * count, i) + 4 * k, "", ".part_rotations", parts[k]);
      if (!fault.first.empty()) return fault;
    }
    keep_parts(std::move(parts), object);
    return {};
  }

  void insert(const UpdateBatch& batch, const InsertColumns& columns, size_t i, const std::string& field) {
    Object object;
    object.id = columns.ids[i];
    Fault fault;
    if (object.id == 0) {
      fault = {".ids", Reason::kOutOfRange};
    } else if (instances_.contains(object.id) || (next_.contains(object.id) && !batch.upsert)) {
      fault = {".ids", Reason::kDuplicateId};
    } else {
      fault = read_pose(batch, columns, i, object.shape);
      if (fault.first.empty()) fault = read_shape(columns, i, object.shape);
      if (fault.first.empty() && columns.kind == ShapeKind::kCompound) fault = read_parts(columns, object);
    }
    const uint64_t expire_ticks = columns.expire_ticks.empty() ? 0 : *entry(columns.expire_ticks, 1, i);
    if (fault.first.empty() && expire_ticks > uint64_t{1} << 48) fault = {".expire_ticks", Reason::kOutOfRange};
    if (fault.first.empty()) next_ends_[object.id] = {expire_ticks, owner_};
    read_labels(columns, i, object);
    if (fault.first.empty() && !next_.contains(object.id)) next_lifetimes_[object.id] = ++last_life_;
    if (fault.first.empty()) next_[object.id] = object;
    count(fault.second, field + fault.first, i, object.id);
  }

  void move(const UpdateBatch& batch, const MoveColumns& columns, size_t i, const std::string& field) {
    const Id id = columns.ids[i];
    const auto known = next_.find(id);
    if (known == next_.end()) return count(Reason::kUnknownId, field + ".ids", i, id);
    Object object = known->second;
    Fault fault = read_pose(batch, columns, i, object.shape);
    if (fault.first.empty() && columns.parts_each != 0) fault = move_parts(columns, i, object);
    if (fault.first.empty()) known->second = object;
    if (fault.first.empty() && columns.teleport) next_lifetimes_[id] = ++last_life_;
    count(fault.second, field + fault.first, i, id);
  }

  void move_instance(const UpdateBatch& batch, const InstanceMoveColumns& columns, size_t i, const std::string& field) {
    const Id id = columns.ids[i];
    const auto known = next_instances_.find(id);
    if (known == next_instances_.end()) return count(Reason::kUnknownId, field + ".ids", i, id);
    Placed placed = known->second;
    Fault fault = read_pose(batch, columns, i, placed.pose);
    if (fault.first.empty() && !columns.scales.empty()) {
      placed.scale = *entry(columns.scales, 1, i);
      if (!std::isfinite(placed.scale)) fault = {".scales", Reason::kNotFinite};
      if (placed.scale < 1e-12f || placed.scale > 1e12f) fault = {".scales", Reason::kOutOfRange};
    }
    if (fault.first.empty()) known->second = placed;
    if (fault.first.empty() && columns.teleport && history_ticks_ != 0) next_jumps_ = true;
    count(fault.second, field + fault.first, i, id);
  }

  void relabel_instance(const RelabelColumns& columns, size_t i, const std::string& field) {
    const auto known = next_instances_.find(columns.ids[i]);
    if (known == next_instances_.end()) return count(Reason::kUnknownId, field + ".ids", i, columns.ids[i]);
    read_labels(columns, i, known->second);
    count(Reason::kUnspecified, field, i, columns.ids[i]);
  }

  void relabel(const RelabelColumns& columns, size_t i, const std::string& field) {
    const auto known = next_.find(columns.ids[i]);
    if (known == next_.end()) return count(Reason::kUnknownId, field + ".ids", i, columns.ids[i]);
    read_labels(columns, i, known->second);
    count(Reason::kUnspecified, field, i, columns.ids[i]);
  }

  // For each object, the unique number of its lifetime. A lifetime begins when an id is inserted that the scene does
  // not contain, and at a teleport.
  using Lifetimes = std::map<Id, uint64_t>;
  struct Then {
    Objects objects;
    Lifetimes lifetimes;
  };

  uint64_t history_ticks_;
  std::map<uint64_t, Then> past_;  // recorded states, by tick
  Lifetimes lifetimes_, next_lifetimes_;
  uint64_t last_life_ = 0;
  Instances instances_, next_instances_;
  bool next_jumps_ = false;  // an instance teleports, and the scene has a history
  Objects objects_;
  Objects next_;
  Ends ends_, next_ends_;
  bool ends_change_ = false;  // the batch changes the expiry of an object that it does not otherwise change
  std::map<uint64_t, uint32_t> leases_;
  uint64_t owner_ = 0;                  // owner of the objects that the batch inserts
  uint32_t message_ = 0;                // index of the message that is being applied
  std::vector<CompoundPtr> compounds_;  // owns the compounds of all states
  UpdateAck ack_;
  uint64_t revision_ = 0;
  uint64_t tick_ = 0;
  std::map<uint64_t, std::pair<uint64_t, UpdateAck>> writers_;  // by writer id: number of the last batch and its ack
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SCENE_MODEL_H_
