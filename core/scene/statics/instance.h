// Placement of a mesh in a scene. Plain data, immutable once it is in a StaticSet.
#ifndef LOCUS_CORE_SCENE_STATICS_INSTANCE_H_
#define LOCUS_CORE_SCENE_STATICS_INSTANCE_H_

#include <memory>

#include "core/base/ids.h"
#include "core/geometry/primitive_traits.h"
#include "core/geometry/transform.h"
#include "core/scene/statics/static_mesh.h"

namespace locus {

struct Instance {
  Id id = kNoId;
  Group group = 0;
  Tag tag = 0;
  Layers layers = kDefaultLayers;
  std::shared_ptr<const StaticMesh> mesh;
  Transform transform;
  Aabbd bounds;  // world bounds of the whole mesh
  // Identifies the stay of the instance in the scene, from its placement to its removal or to the next jump. Unique in
  // the process; 0 before the instance is placed.
  uint64_t life = 0;
};

template <>
struct PrimitiveTraits<Instance> {
  using Scalar = double;
  static uint64_t id(const Instance& instance) { return instance.id; }
  static Aabbd bounds(const Instance& instance) { return instance.bounds; }
  static Vec3d position(const Instance& instance) { return instance.transform.translation; }
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_STATICS_INSTANCE_H_
