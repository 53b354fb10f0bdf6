// Placement of a mesh in a scene. Plain data, immutable once it is in a StaticSet.
#ifndef LOCUS_CORE_SCENE_STATICS_INSTANCE_H_
#define LOCUS_CORE_SCENE_STATICS_INSTANCE_H_

#include <atomic>
#include <limits>
#include <memory>

#include "core/base/ids.h"
#include "core/base/limits.h"
#include "core/base/planted_bug.h"
#include "core/geometry/primitive_traits.h"
#include "core/geometry/transform.h"
#include "core/scene/statics/static_mesh.h"

namespace locus {

struct Instance {
  Id id = kNoId;
  Group group = 0;
  Tag tag = 0;
  Layers layers = kDefaultLayers;
  // Identifies the stay of the instance in the scene, from its placement to its removal or, in a scene with history, to
  // its next jump; 0 before the instance is placed. Two stays of one id have different numbers, unless 2^32 stays are
  // between them.
  uint32_t life = 0;
  std::shared_ptr<const StaticMesh> mesh;
  Transform transform;
  Aabbd bounds;  // world bounds of the whole mesh
};

template <>
struct PrimitiveTraits<Instance> {
  using Scalar = double;
  static uint64_t id(const Instance& instance) { return instance.id; }
  static Aabbd bounds(const Instance& instance) { return instance.bounds; }
  static Vec3d position(const Instance& instance) { return instance.transform.translation; }
};

// Maximum absolute coordinate of the bounds of a placed mesh. Higher than the limit of positions, because a mesh may
// extend beyond the position of its instance.
inline constexpr double kMaxPlacedBound = 2 * limits::kMaxCoordinate;

// Sets the transform and the bounds of an instance, whose mesh is set. Returns false, and changes nothing, if the
// bounds would exceed kMaxPlacedBound.
inline bool place_at(const Transform& transform, Instance& instance) {
  const Aabbd bounds = bounds_to_world(transform, instance.mesh->bounds());
  if (magnitude(bounds) > kMaxPlacedBound) return false;
  instance.transform = transform;
  if (!planted(PlantedBug::kStalePlacedBounds) || instance.life == 0) instance.bounds = bounds;
  return true;
}

// Returns true if two states of an instance are the same, including the life.
inline bool is_same(const Instance& a, const Instance& b) {
  return a.life == b.life && a.group == b.group && a.tag == b.tag && a.layers == b.layers &&
         a.transform.translation == b.transform.translation && a.transform.quaternion == b.transform.quaternion &&
         a.transform.scale == b.transform.scale;
}

// Returns another number for Instance::life at each call, never 0.
inline uint32_t new_life() {
  static std::atomic<uint64_t> last{0};
  return static_cast<uint32_t>(last.fetch_add(1, std::memory_order_relaxed) % std::numeric_limits<uint32_t>::max()) + 1;
}

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_STATICS_INSTANCE_H_
