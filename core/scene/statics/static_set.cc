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

namespace locus {
namespace {

// Maximum absolute coordinate of the bounds of a placed mesh. Higher than the limit of positions, because a mesh may
// extend beyond the position of its instance.
constexpr double kMaxPlacedBound = 2 * limits::kMaxCoordinate;

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
  instance.transform = transform;
  instance.bounds = bounds_to_world(transform, place.mesh->bounds());
  instance.layers = ColumnReader<uint32_t>(place.layers, 1).value(i, kDefaultLayers);
  instance.group = ColumnReader<uint64_t>(place.groups, 1).value(i, 0);
  instance.tag = ColumnReader<uint64_t>(place.tags, 1).value(i, 0);
  if (magnitude(instance.bounds) > kMaxPlacedBound)
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

// Ids of the instances of a set that is being built. Checks the ids of placements, or chooses ids for them.
class InstanceIds {
 public:
  InstanceIds(const std::function<bool(Id)>& is_object, const std::function<Id()>& next_id)
      : is_object_(is_object), next_id_(next_id) {}

  void take(Id id) { taken_.insert(id); }

  // Checks placements and passes each of their instances to `keep`.
  template <class Keep>
  absl::Status place(const PlacementColumns& columns, const std::string& field, const Keep& keep) {
    LOCUS_CHECK(columns.mesh != nullptr);
    RETURN_IF_ERROR(check_columns(columns, field));
    const size_t n = columns.count();
    if (taken_.size() + n > limits::kMaxInstances)
      return refuse_full(field, "instances", limits::kMaxInstances, static_cast<double>(taken_.size() + n), 0);
    for (uint32_t i = 0; i < n; ++i) {
      ASSIGN_OR_RETURN(Instance instance, read_instance(columns, i, field));
      instance.id = columns.ids.empty() ? choose_id() : columns.ids[i];
      RETURN_IF_ERROR(check_id(instance.id, i, field));
      taken_.insert(instance.id);
      keep(std::move(instance));
    }
    return absl::OkStatus();
  }

 private:
  absl::Status check_id(Id id, uint32_t i, const std::string& field) const {
    if (id == kNoId) return refuse_argument(Reason::kOutOfRange, field + ".ids", i, "0 is no id");
    if (taken_.contains(id) || is_object_(id))
      return refuse_argument(Reason::kDuplicateId, field + ".ids", i,
                             absl::StrCat("the id ", id, " is taken; instances and objects share one id space"));
    return absl::OkStatus();
  }

  Id choose_id() {
    Id id = kNoId;
    do {
      id = next_id_();
    } while (taken_.contains(id) || is_object_(id));
    return id;
  }

  const std::function<bool(Id)>& is_object_;
  const std::function<Id()>& next_id_;
  absl::flat_hash_set<Id> taken_;
};

// Static change that is being applied. Collects the instances of the new set: first the old instances that are not
// removed, then the placed instances.
class Changing {
 public:
  Changing(const StaticSet& old, const std::function<bool(Id)>& is_object, const std::function<Id()>& next_id)
      : old_(old), ids_(is_object, next_id) {}

  absl::Status remove(const StaticChange& change) {
    absl::flat_hash_set<Id> removed;
    for (size_t i = 0; i < change.remove_ids.size(); ++i) {
      const Id id = change.remove_ids[i];
      if (old_.find(id) == nullptr)
        return refuse_argument(Reason::kUnknownId, "remove_ids", static_cast<uint32_t>(i),
                               absl::StrCat("no instance has the id ", id));
      removed.insert(id);
    }
    const absl::flat_hash_set<Group> groups(change.remove_groups.begin(), change.remove_groups.end());
    if (groups.contains(0)) return refuse_group_zero(change);
    for (const Instance& instance : old_.tree().values()) {
      if (removed.contains(instance.id) || groups.contains(instance.group)) continue;
      instances_.push_back(instance);
      ids_.take(instance.id);
    }
    return absl::OkStatus();
  }

  absl::Status place(const PlacementColumns& columns, const std::string& field) {
    return ids_.place(columns, field, [this](Instance instance) {
      placed_.push_back(instance.id);
      instances_.push_back(std::move(instance));
    });
  }

  std::vector<Instance>& instances() { return instances_; }
  std::vector<Id>& placed() { return placed_; }

 private:
  const StaticSet& old_;
  InstanceIds ids_;
  std::vector<Instance> instances_;
  std::vector<Id> placed_;
};

}  // namespace

void StaticSet::check_invariants() const {
  LOCUS_CHECK_EQ(positions_.size(), tree_.size());
  for (uint32_t i = 0; i < tree_.values().size(); ++i) {
    const Instance& instance = tree_.values()[i];
    LOCUS_CHECK_NE(instance.id, kNoId);
    LOCUS_CHECK(instance.mesh != nullptr);
    LOCUS_CHECK_EQ(positions_.at(instance.id), i);
  }
  size_t uses = 0;
  for (const auto& [mesh, count] : uses_) uses += count;
  LOCUS_CHECK_EQ(uses, tree_.size());
}

std::shared_ptr<const StaticSet> StaticSet::empty() { return std::shared_ptr<const StaticSet>(new StaticSet()); }

absl::StatusOr<StaticSet::Changed> StaticSet::apply(const StaticChange& change,
                                                    const std::function<bool(Id)>& is_object,
                                                    const std::function<Id()>& next_id) const {
  Changing changing(*this, is_object, next_id);
  RETURN_IF_ERROR(changing.remove(change));
  for (size_t i = 0; i < change.place.size(); ++i)
    RETURN_IF_ERROR(changing.place(change.place[i], absl::StrCat("place[", i, "]")));
  ASSIGN_OR_RETURN(Bvh<Instance> tree, Bvh<Instance>::build(std::move(changing.instances()), BvhOptions{}));
  std::shared_ptr<StaticSet> set(new StaticSet());
  set->tree_ = std::move(tree);
  for (uint32_t i = 0; i < set->tree_.values().size(); ++i) {
    const Instance& instance = set->tree_.values()[i];
    set->positions_.emplace(instance.id, i);
    ++set->uses_[instance.mesh.get()];
    set->triangle_count_ += instance.mesh->triangle_count();
  }
  set->mesh_bytes_ = bytes_of_meshes(set->uses_);
  LOCUS_DCHECK_CALL(set->check_invariants());
  return Changed{std::move(set), std::move(changing.placed())};
}

absl::Status StaticSet::check_placements(absl::Span<const PlacementColumns> place) {
  const std::function<bool(Id)> no_object = [](Id) { return false; };
  const std::function<Id()> next_id = ids_from(kFirstChosenId);
  InstanceIds ids(no_object, next_id);
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
  const auto found = positions_.find(id);
  if (found == positions_.end()) return nullptr;
  LOCUS_DCHECK_EQ(tree_.values()[found->second].id, id);
  return &tree_.values()[found->second];
}

uint32_t StaticSet::uses(const StaticMesh* mesh) const {
  const auto found = uses_.find(mesh);
  return found == uses_.end() ? 0 : found->second;
}

uint64_t StaticSet::bytes() const { return tree_.bytes() + positions_.capacity() * (sizeof(Id) + sizeof(uint32_t)); }

}  // namespace locus
