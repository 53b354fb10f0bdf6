// Static part of a scene: instances of meshes and a tree over them. Immutable, shared by snapshots, any thread; a
// change makes a new set, so that a failed change has no effect. Invariants: ids are distinct and not 0; positions_ has
// one entry for each instance; the counts of uses_ add up to size().
#ifndef LOCUS_CORE_SCENE_STATICS_STATIC_SET_H_
#define LOCUS_CORE_SCENE_STATICS_STATIC_SET_H_

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/index/bvh/bvh.h"
#include "core/scene/statics/instance.h"

namespace locus {

// Borrowed columns of the placements of one mesh. N is the number of ids, or of translations if there are no ids. Each
// other column has N entries, one entry for all placements, or none for the default in brackets.
struct PlacementColumns {
  std::shared_ptr<const StaticMesh> mesh;
  absl::Span<const uint64_t> ids;         // [chosen by the set, with bit 63 set]
  absl::Span<const double> translations;  // 3N; with ids, 3 for all are enough
  absl::Span<const float> rotations;      // 4N, x y z w [identity]
  absl::Span<const float> scales;         // N, > 0 [1]
  absl::Span<const uint32_t> layers;      // [bit 0]
  absl::Span<const uint64_t> groups;      // [0]
  absl::Span<const uint64_t> tags;        // [0]

  size_t count() const { return ids.empty() ? translations.size() / 3 : ids.size(); }
};

struct StaticChange {
  absl::Span<const uint64_t> remove_ids;
  absl::Span<const uint64_t> remove_groups;
  std::vector<PlacementColumns> place;
};

class StaticSet {
 public:
  // Returns the set without instances.
  static std::shared_ptr<const StaticSet> empty();

  struct Changed {
    std::shared_ptr<const StaticSet> set;
    std::vector<Id> placed;  // in the order of the request, chosen ids included
  };
  // Returns a new set without the instances that the change removes and with those that it places. `is_object` returns
  // true for the id of an object, which no instance may have. Ids that the set chooses are counted up from `seed`. An
  // error refuses the whole change and names the field and index of the wrong value. O(instances).
  absl::StatusOr<Changed> apply(const StaticChange& change, const std::function<bool(Id)>& is_object,
                                uint64_t seed) const;

  const Bvh<Instance>& tree() const { return tree_; }
  const Instance* find(Id id) const;
  size_t size() const { return tree_.size(); }
  uint64_t triangle_count() const { return triangle_count_; }
  // Returns the number of instances of `mesh`, without instances of equal meshes under other names.
  uint32_t uses(const StaticMesh* mesh) const;
  // Returns the size in bytes of the set without the meshes, which sets share.
  uint64_t bytes() const;

 private:
  StaticSet() = default;
  // Checks the invariants of the class comment. O(instances), like building the set.
  void check_invariants() const;

  Bvh<Instance> tree_;
  absl::flat_hash_map<Id, uint32_t> positions_;  // index into tree_.values()
  absl::flat_hash_map<const StaticMesh*, uint32_t> uses_;
  uint64_t triangle_count_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_STATICS_STATIC_SET_H_
