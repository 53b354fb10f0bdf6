// Moving objects of `locus demo`. An object's pose is a pure function of its index and the tick, so that an answer can
// be checked against the objects at the answer's tick. Immutable after construction.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_DEMO_DEMO_WORLD_H_
#define LOCUS_CLIENT_CLI_EXTRAS_DEMO_DEMO_WORLD_H_

#include <cstdint>
#include <vector>

#include "client/cli/levels/import/imported_mesh.h"
#include "client/lib/update_builder.h"
#include "core/geometry/aabb.h"
#include "core/geometry/shape.h"

namespace locus::cli {

class DemoWorld {
 public:
  static constexpr uint64_t kFirstObjectId = 1'000'000;

  // Creates `objects` objects that move within `bounds`, the bounds of the level in world coordinates.
  DemoWorld(const Aabbd& bounds, uint32_t objects, uint64_t seed);

  const Aabbd& bounds() const { return bounds_; }
  // Returns the frame of all updates and queries: the origin of their float positions.
  Vec3d frame() const { return frame_; }
  uint32_t size() const { return static_cast<uint32_t>(objects_.size()); }
  uint64_t id(uint32_t index) const { return kFirstObjectId + index; }

  // Returns object `index` as the server stores it at `tick`.
  Shape shape(uint32_t index, uint64_t tick) const;

  // Returns the batch that removes all objects of the scene and inserts all objects of this world at tick 0.
  v1::UpdateBatch inserts() const;
  // Returns the batch that moves all objects to their positions at `tick`.
  v1::UpdateBatch moves(uint64_t tick) const;

 private:
  struct DemoObject {
    ShapeKind kind;
    Vec3f start;     // relative to the frame
    Vec3f velocity;  // distance per tick
    Vec3f size;
    float radius;
    locus::Quaternion rotation;
  };

  Vec3f offset(const DemoObject& object, uint64_t tick) const;

  Aabbd bounds_;
  Vec3d frame_;
  Vec3f half_;  // half extent of the region around frame_ in which objects move
  std::vector<DemoObject> objects_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_DEMO_DEMO_WORLD_H_
