#include "core/scene/statics/static_set.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/column.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "core/index/bvh/bvh_change.h"

namespace locus {
namespace {

absl::Status check_columns(const PlacementColumns& place, const std::string& field) {
  const size_t n = place.count();
  const auto check = [&](size_t numbers, size_t width, ColumnNeed need, absl::string_view name) {
    return check_column(numbers, width, n, need, {field, {}, name});
  };
  RETURN_IF_ERROR(check(place.translations.size(), 3, ColumnNeed::kEachOrOne, "translations"));
  RETURN_IF_ERROR(check(place.rotations.size(), 4, ColumnNeed::kOptional, "rotations"));
  RETURN_IF_ERROR(check(place.scales.size(), 1, ColumnNeed::kOptional, "scales"));
  RETURN_IF_ERROR(check(place.layers.size(), 1, ColumnNeed::kOptional, "layers"));
  RETURN_IF_ERROR(check(place.groups.size(), 1, ColumnNeed::kOptional, "groups"));
  return check(place.tags.size(), 1, ColumnNeed::kOptional, "tags");
}

absl::StatusOr<Quaternion> read_rotation(const PlacementColumns& place, uint32_t i, const std::string& field) {
  const ColumnReader<float> rotations(place.rotations, 4);
  if (!rotations.given()) return Quaternion{};
  const float* q = rotations.entry(i);
  const Quaternion quaternion{q[0], q[1], q[2], q[3]};
  const double deviation = unit_deviation(quaternion);
  if (!std::isfinite(deviation))
    return refuse_argument(Reason::kNotFinite, field + ".rotations", i, "a quaternion needs finite numbers");
  if (deviation > limits::kMaxQuaternionDeviation)
    return refuse_argument(Reason::kOutOfRange, field + ".rotations", i,
                           "a quaternion (x, y, z, w) must be of unit length");
  return normalized(quaternion);
}

absl::StatusOr<Transform> read_transform(const PlacementColumns& place, uint32_t i, const std::string& field) {
  const double* t = ColumnReader<double>(place.translations, 3).entry(i);
  const Vec3d translation{t[0], t[1], t[2]};
  if (!is_finite(translation))
    return refuse_argument(Reason::kNotFinite, field + ".translations", i, "a translation needs finite numbers");
  if (max_component(abs(translation)) > limits::kMaxCoordinate)
    return refuse_argument(Reason::kOutOfRange, field + ".translations", i, "translations must lie within +-1e9");
  const float scale = ColumnReader<float>(place.scales, 1).value(i, 1.0f);
  if (!std::isfinite(scale))
    return refuse_argument(Reason::kNotFinite, field + ".scales", i, "a scale must be a finite number");
  if (!(scale >= limits::kMinScale && scale <= limits::kMaxScale))
    return refuse_argument(Reason::kOutOfRange, field + ".scales", i, "a scale must lie within 1e-12 and 1e12");
  ASSIGN_OR_RETURN(Quaternion rotation, read_rotation(place, i, field));
  return make_transform(translation, rotation, scale);
}

absl::StatusOr<Instance> read_instance(const PlacementColumns& place, uint32_t i, const std::string& field) {
  ASSIGN_OR_RETURN(Transform transform, read_transform(place, i, field));
  Instance instance;
  instance.mesh = place.mesh;
  instance.layers = ColumnReader<uint32_t>(place.layers, 1).value(i, kDefaultLayers);
  instance.group = ColumnReader<uint64_t>(place.groups, 1).value(i, 0);
  instance.tag = ColumnReader<uint64_t>(place.tags, 1).value(i, 0);
  if (!place_at(transform, instance))
    return refuse_argument(Reason::kOutOfRange, field + ".scales", i, "the placed mesh must lie within +-2e9");
  return instance;
}

absl::Status refuse_group_zero(const StaticChange& change) {
  const auto zero = std::find(change.remove_groups.begin(), change.remove_groups.end(), Group{0});
  return refuse_argument(Reason::kOutOfRange, "remove_groups",
                         static_cast<uint32_t>(zero - change.remove_groups.begin()), "0 means no group");
}

uint64_t bytes_of_meshes(const absl::flat_hash_map<const StaticMesh*, uint32_t>& uses) {
  absl::flat_hash_set<Sha256> contents;
  uint64_t bytes = 0;
  for (const auto& [mesh, count] : uses)
    bytes += mesh->bytes() - (contents.insert(mesh->sha256()).second ? 0 : mesh->shared_bytes());
  return bytes;
}

// Ids of the instances of a set that is being changed. Checks the ids of placements, or chooses ids for them.
class InstanceIds {
 public:
  InstanceIds(const StaticSet& old, const std::function<bool(Id)>& is_object, const std::function<Id()>& next_id)
      : old_(old), is_object_(is_object), next_id_(next_id) {}

  // Frees the id of an instance of the old set.
  void remove(Id id) { removed_.insert(id); }
  bool is_removed(Id id) const { return removed_.contains(id); }

  // Checks placements and passes each of their instances to `keep`.
  template <class Keep>
  absl::Status place(const PlacementColumns& columns, const std::string& field, const Keep& keep) {
    LOCUS_CHECK(columns.mesh != nullptr);
    RETURN_IF_ERROR(check_columns(columns, field));
    const size_t n = columns.count(), size = old_.size() - removed_.size() + placed_.size();
    if (size + n > limits::kMaxInstances)
      return refuse_full(field, "instances", limits::kMaxInstances, static_cast<double>(size + n), 0);
    for (uint32_t i = 0; i < n; ++i) {
      ASSIGN_OR_RETURN(Instance instance, read_instance(columns, i, field));
      instance.id = columns.ids.empty() ? choose_id() : columns.ids[i];
      RETURN_IF_ERROR(check_id(instance.id, i, field));
      placed_.insert(instance.id);
      keep(std::move(instance));
    }
    return absl::OkStatus();
  }

 private:
  bool is_taken(Id id) const {
    return placed_.contains(id) || (old_.find(id) != nullptr && !removed_.contains(id)) || is_object_(id);
  }
  absl::Status check_id(Id id, uint32_t i, const std::string& field) const {
    if (id == kNoId) return refuse_argument(Reason::kOutOfRange, field + ".ids", i, "0 is no id");
    if (is_taken(id))
      return refuse_argument(Reason::kDuplicateId, field + ".ids", i,
                             absl::StrCat("the id ", id, " is taken; instances and objects share one id space"));
    return absl::OkStatus();
  }

  Id choose_id() {
    Id id = kNoId;
    do {
      id = next_id_();
    } while (is_taken(id));
    return id;
  }

  const StaticSet& old_;
  const std::function<bool(Id)>& is_object_;
  const std::function<Id()>& next_id_;
  absl::flat_hash_set<Id> removed_;
  absl::flat_hash_set<Id> placed_;
};

// Static change that is being applied: collects what changes in the tree over instances.
class Changing {
 public:
  Changing(const StaticSet& old, const std::function<bool(Id)>& is_object, const std::function<Id()>& next_id)
      : old_(old), ids_(old, is_object, next_id) {}

  absl::Status remove(const StaticChange& change) {
    for (size_t i = 0; i < change.remove_ids.size(); ++i) {
      const Id id = change.remove_ids[i];
      if (old_.find(id) == nullptr)
        return refuse_argument(Reason::kUnknownId, "remove_ids", static_cast<uint32_t>(i),
                               absl::StrCat("no instance has the id ", id));
      remove(id);
    }
    const absl::flat_hash_set<Group> groups(change.remove_groups.begin(), change.remove_groups.end());
    if (groups.contains(0)) return refuse_group_zero(change);
    if (groups.empty()) return absl::OkStatus();
    for (const Instance& instance : old_.tree().values())
      if (groups.contains(instance.group)) remove(instance.id);
    return absl::OkStatus();
  }

  absl::Status place(const PlacementColumns& columns, const std::string& field) {
    return ids_.place(columns, field, [this](Instance instance) {
      placed_.push_back(instance.id);
      instance.life = new_life();
      tree_.added.push_back(std::move(instance));
    });
  }

  // Ids of the instances that the change removes, and those that it places.
  const std::vector<Id>& removed() const { return removed_; }
  std::vector<Id>& placed() { return placed_; }
  BvhChange<Instance>& tree() { return tree_; }

 private:
  void remove(Id id) {
    if (ids_.is_removed(id)) return;
    ids_.remove(id);
    removed_.push_back(id);
    tree_.removed.push_back(old_.position(id));
  }

  const StaticSet& old_;
  InstanceIds ids_;
  BvhChange<Instance> tree_;
  std::vector<Id> removed_;
  std::vector<Id> placed_;
};

}  // namespace

void StaticSet::check_invariants() const {
  LOCUS_CHECK_EQ(positions_.size(), tree_.size());
  for (const Instance& instance : tree_.values()) {
    LOCUS_CHECK_NE(instance.id, kNoId);
    LOCUS_CHECK_NE(instance.life, 0u);
    LOCUS_CHECK(instance.mesh != nullptr);
    LOCUS_CHECK_EQ(find(instance.id), &instance);
  }
  size_t uses = 0;
  for (const auto& [mesh, count] : *uses_) uses += count;
  LOCUS_CHECK_EQ(uses, tree_.size());
}

const std::shared_ptr<const StaticSet>& StaticSet::empty() {
  static const std::shared_ptr<const StaticSet>& set = *new std::shared_ptr<const StaticSet>(new StaticSet());
  return set;
}

std::shared_ptr<StaticSet> StaticSet::with_tree(const StaticSet& old, Bvh<Instance>::Changed changed,
                                                absl::Span<const Id> removed) {
  std::shared_ptr<StaticSet> set(new StaticSet());
  set->tree_ = std::move(changed.tree);
  set->positions_ = old.positions_;
  for (const Id id : removed) set->positions_.erase(id);
  set->positions_.fit(set->tree_.size());
  for (const uint32_t block : changed.blocks) {
    uint32_t position = block * kBvhBlockValues;
    for (const Instance& instance : set->tree_.block(block)) set->positions_.set(instance.id, position++);
  }
  set->positions_.snapshot();  // so that the table can be copied
  return set;
}

absl::StatusOr<StaticSet::Changed> StaticSet::apply(const StaticChange& change,
                                                    const std::function<bool(Id)>& is_object,
                                                    const std::function<Id()>& next_id) const {
  Changing changing(*this, is_object, next_id);
  RETURN_IF_ERROR(changing.remove(change));
  for (size_t i = 0; i < change.place.size(); ++i)
    RETURN_IF_ERROR(changing.place(change.place[i], absl::StrCat("place[", i, "]")));
  Uses uses = *uses_;
  uint64_t triangle_count = triangle_count_;
  for (const Id id : changing.removed()) {
    const StaticMesh* const mesh = find(id)->mesh.get();
    triangle_count -= mesh->triangle_count();
    if (--uses[mesh] == 0) uses.erase(mesh);
  }
  for (const Instance& instance : changing.tree().added) {
    triangle_count += instance.mesh->triangle_count();
    ++uses[instance.mesh.get()];
  }
  ASSIGN_OR_RETURN(Bvh<Instance>::Changed tree, tree_.change(std::move(changing.tree())));
  std::shared_ptr<StaticSet> set = with_tree(*this, std::move(tree), changing.removed());
  set->triangle_count_ = triangle_count;
  set->mesh_bytes_ = bytes_of_meshes(uses);
  set->uses_ = std::make_shared<const Uses>(std::move(uses));
  LOCUS_DCHECK_CALL(set->check_invariants());
  return Changed{std::move(set), std::move(changing.placed())};
}

std::shared_ptr<const StaticSet> StaticSet::replace(std::vector<Instance> changed) const {
  BvhChange<Instance> change;
  change.replaced.reserve(changed.size());
  for (Instance& instance : changed) {
    const uint32_t at = position(instance.id);
    LOCUS_DCHECK(tree_.at(at).mesh == instance.mesh);
    change.replaced.push_back({at, std::move(instance)});
  }
  // Fails only for bounds that are not finite and for too many values, and the instances have passed these checks.
  absl::StatusOr<Bvh<Instance>::Changed> tree = tree_.change(std::move(change));
  LOCUS_CHECK(tree.ok());
  std::shared_ptr<StaticSet> set = with_tree(*this, *std::move(tree), {});
  set->triangle_count_ = triangle_count_;
  set->mesh_bytes_ = mesh_bytes_;
  set->uses_ = uses_;
  LOCUS_DCHECK_CALL(set->check_invariants());
  return set;
}

bool StaticSet::regrouped_since(const StaticSet& base, absl::Span<const Group> groups) const {
  if (groups.empty()) return false;
  const absl::flat_hash_set<Group> looked_for(groups.begin(), groups.end());
  bool regrouped = false;
  tree_.for_each_apart_from(base.tree_, [&](const Instance& instance) {
    const Group before = base.find(instance.id)->group;
    regrouped |= before != instance.group && looked_for.contains(before) != looked_for.contains(instance.group);
  });
  return regrouped;
}

std::shared_ptr<const StaticSet> StaticSet::with_updates(const StaticSet& base, const StaticSet& updated) const {
  std::vector<Instance> changed;
  updated.tree_.for_each_apart_from(base.tree_, [&](const Instance& instance) {
    const Instance* const before = base.find(instance.id);
    const Instance* const now = find(instance.id);
    LOCUS_DCHECK(before != nullptr);
    if (now != nullptr && now->life == before->life && !is_same(instance, *before)) changed.push_back(instance);
  });
  return replace(std::move(changed));
}

absl::Status StaticSet::check_placements(absl::Span<const PlacementColumns> place) {
  const std::function<bool(Id)> no_object = [](Id) { return false; };
  const std::function<Id()> next_id = ids_from(kFirstChosenId);
  InstanceIds ids(*empty(), no_object, next_id);
  for (size_t i = 0; i < place.size(); ++i)
    RETURN_IF_ERROR(ids.place(place[i], absl::StrCat("place[", i, "]"), [](const Instance&) {}));
  return absl::OkStatus();
}

Id StaticSet::first_id_above() const {
  Id first = kFirstChosenId;
  for (const Instance& instance : tree_.values())
    if (instance.id < kEndOfChosenIds) first = std::max(first, instance.id + 1);
  return first;
}

const Instance* StaticSet::find(Id id) const {
  const uint32_t found = positions_.find(id);
  if (found == PersistentIdTable<>::kNone) return nullptr;
  LOCUS_DCHECK_EQ(tree_.at(found).id, id);
  return &tree_.at(found);
}

uint32_t StaticSet::position(Id id) const {
  const uint32_t found = positions_.find(id);
  LOCUS_DCHECK_NE(found, PersistentIdTable<>::kNone);
  return found;
}

uint32_t StaticSet::uses(const StaticMesh* mesh) const {
  const auto found = uses_->find(mesh);
  return found == uses_->end() ? 0 : found->second;
}

std::vector<const StaticMesh*> StaticSet::meshes() const {
  std::vector<const StaticMesh*> meshes;
  meshes.reserve(uses_->size());
  for (const auto& [mesh, uses] : *uses_) meshes.push_back(mesh);
  return meshes;
}

uint64_t StaticSet::unshared_bytes(const StaticSet& other) const {
  if (this == &other) return 0;
  const uint64_t uses = uses_ == other.uses_ ? 0 : uses_->capacity() * (sizeof(Uses::value_type) + 1);
  return tree_.unshared_bytes(other.tree_) + positions_.unshared_bytes(other.positions_) + uses;
}

}  // namespace locus
