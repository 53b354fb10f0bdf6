// Static part of a scene: instances of meshes and a tree over these instances. Immutable, shared by snapshots, and safe
// to read from any thread. A change makes a new set, so that a failed change has no effect. The new set shares with the
// old one the parts of the tree and of the table of ids that the change does not touch. Invariants: ids are distinct
// and not 0; positions_ has one entry for each instance; the counts of uses_ add up to size().
#ifndef LOCUS_CORE_SCENE_STATICS_STATIC_SET_H_
#define LOCUS_CORE_SCENE_STATICS_STATIC_SET_H_

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/base/persistent_id_table.h"
#include "core/index/bvh/bvh.h"
#include "core/scene/statics/instance.h"

namespace locus {

// Borrowed columns of the placements of one mesh. Let N be the number of ids, or of translations if there are no ids.
// Each other column has N entries, or one entry for all placements, or no entries. The default applies to a column
// without entries.
struct PlacementColumns {
  std::shared_ptr<const StaticMesh> mesh;
  absl::Span<const uint64_t> ids;         // if empty, the scene chooses the ids
  absl::Span<const double> translations;  // entries x y z; not empty
  absl::Span<const float> rotations;      // quaternions x y z w; default: no rotation
  absl::Span<const float> scales;         // > 0; default: 1
  absl::Span<const uint32_t> layers;      // default: bit 0
  absl::Span<const uint64_t> groups;      // default: 0, no group
  absl::Span<const uint64_t> tags;        // default: 0

  size_t count() const { return ids.empty() ? translations.size() / 3 : ids.size(); }
};

struct StaticChange {
  absl::Span<const uint64_t> remove_ids;
  absl::Span<const uint64_t> remove_groups;
  std::vector<PlacementColumns> place;
};

// Returns a function that returns `first`, and then one more at each call.
inline std::function<Id()> ids_from(Id first) {
  return [next = first]() mutable { return next++; };
}

class StaticSet {
 public:
  // Returns the set without instances.
  static const std::shared_ptr<const StaticSet>& empty();

  struct Changed {
    std::shared_ptr<const StaticSet> set;
    std::vector<Id> placed;  // ids of the placed instances, in the order of the request
  };
  // Returns a new set without the instances that the change removes, and with the instances that the change places.
  // `is_object` returns true for the id of an object; no instance may have the id of an object. `next_id` returns
  // another id at each call; placements without ids get these ids, except ids that are taken. An error refuses the
  // whole change and names the field and index of the invalid value. Cost: that of Bvh::change(); with remove_groups,
  // also O(instances).
  absl::StatusOr<Changed> apply(const StaticChange& change, const std::function<bool(Id)>& is_object,
                                const std::function<Id()>& next_id) const;
  // Returns a new set in which the instances with the ids of `changed` are those of `changed`, with the same meshes.
  // Preconditions: the set has these ids, which are distinct; place_at() has made the transforms and bounds. Cost: that
  // of Bvh::change().
  std::shared_ptr<const StaticSet> replace(std::vector<Instance> changed) const;
  // Returns true if an instance has one of `groups` in this set and not in `base`, or the other way round.
  // Precondition: update batches alone made this set from `base`, so that both have the same instances.
  bool regrouped_since(const StaticSet& base, absl::Span<const Group> groups) const;
  // Returns this set, which a static change made from `base`, with the changes that update batches made meanwhile, from
  // `base` to `updated`. Changes of instances that this set does not have are dropped.
  std::shared_ptr<const StaticSet> with_updates(const StaticSet& base, const StaticSet& updated) const;
  // Returns the least id from kFirstChosenId on that is above the ids of all instances below kEndOfChosenIds.
  // O(instances).
  Id first_id_above() const;

  // Returns the error that apply() would return for these placements in a scene without instances and objects, or OK.
  // Builds no set, and so needs only about 20 bytes of memory for each placement. O(placements).
  static absl::Status check_placements(absl::Span<const PlacementColumns> place);

  const Bvh<Instance>& tree() const { return tree_; }
  const Instance* find(Id id) const;
  // Returns the position of an instance in tree(). Precondition: the set has the id.
  uint32_t position(Id id) const;
  size_t size() const { return tree_.size(); }
  uint64_t triangle_count() const { return triangle_count_; }
  // Returns the number of instances of `mesh`, not counting instances of meshes with equal content under other names.
  uint32_t uses(const StaticMesh* mesh) const;
  // Returns the meshes of the instances, each once, in any order.
  std::vector<const StaticMesh*> meshes() const;
  // Returns the size in bytes of the set without the meshes, which are shared by several sets.
  uint64_t bytes() const { return unshared_bytes(*empty()); }
  // Returns the size in bytes of the parts that this set does not share with `other`, without the meshes. O(instances /
  // kBvhBlockValues); O(1) if the sets are the same.
  uint64_t unshared_bytes(const StaticSet& other) const;
  // Returns the size in bytes of the meshes of all instances; a content that several meshes share counts once. O(1).
  uint64_t mesh_bytes() const { return mesh_bytes_; }

 private:
  using Uses = absl::flat_hash_map<const StaticMesh*, uint32_t>;

  StaticSet() = default;
  // Makes a set with the tree of `changed`. Ids of `removed` are no longer in the set.
  static std::shared_ptr<StaticSet> with_tree(const StaticSet& old, Bvh<Instance>::Changed changed,
                                              absl::Span<const Id> removed);
  // Checks the invariants of the class comment. O(instances).
  void check_invariants() const;

  Bvh<Instance> tree_;
  PersistentIdTable<> positions_;  // position of each instance in tree_
  std::shared_ptr<const Uses> uses_ =
      std::make_shared<const Uses>();  // shared by sets that have the same instances at other places; never null
  uint64_t triangle_count_ = 0;
  uint64_t mesh_bytes_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_STATICS_STATIC_SET_H_
