// The static part of a scene: instances of meshes and the tree over them. Immutable and shared by snapshots; a change
// makes a new set, so that a failed change leaves the old one as it was.
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

// Columns of one mesh's placements, borrowed. N is the number of ids, or of translations where there are no ids;
// another column has N entries, one for all, or none for the default in brackets.
struct PlacementColumns {
  std::shared_ptr<const StaticMesh> mesh;
  absl::Span<const uint64_t> ids;         // [chosen, bit 63 set]
  absl::Span<const double> translations;  // 3N, or 3 with ids
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
  // The set without instances.
  static std::shared_ptr<const StaticSet> empty();

  struct Changed {
    std::shared_ptr<const StaticSet> set;
    std::vector<Id> placed;  // in the order of the request, chosen ids included
  };
  // Removes, then places. `is_object` tells whether an id is taken by an object; `seed` starts the choice of ids.
  // Refuses the whole change with the field and index of what is wrong.
  absl::StatusOr<Changed> apply(const StaticChange& change, const std::function<bool(Id)>& is_object,
                                uint64_t seed) const;

  const Bvh<Instance>& tree() const { return tree_; }
  const Instance* find(Id id) const;
  size_t size() const { return tree_.size(); }
  uint64_t triangle_count() const { return triangle_count_; }
  // Instances of that mesh.
  uint32_t uses(const StaticMesh* mesh) const;
  // Without the meshes, which sets share.
  uint64_t bytes() const;

 private:
  StaticSet() = default;

  Bvh<Instance> tree_;
  absl::flat_hash_map<Id, uint32_t> positions_;  // into tree_.values()
  absl::flat_hash_map<const StaticMesh*, uint32_t> uses_;
  uint64_t triangle_count_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_STATICS_STATIC_SET_H_
