// The moving objects of `locus demo`: where each is at each tick is a pure function of its number, so that any answer
// can be checked against the very state it was given for. Immutable after construction.
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

  // `bounds`: world bounds of the level, within which the objects move.
  DemoWorld(const Aabbd& bounds, uint32_t objects, uint64_t seed);

  const Aabbd& bounds() const { return bounds_; }
  // Float positions in updates and queries are relative to it.
  Vec3d frame() const { return frame_; }
  uint32_t size() const { return static_cast<uint32_t>(objects_.size()); }
  uint64_t id(uint32_t number) const { return kFirstObjectId + number; }

  // The object as the server stores it at `tick`.
  Shape shape(uint32_t number, uint64_t tick) const;

  // All objects at tick 0, and the moves of all to `tick`.
  v1::UpdateBatch inserts() const;
  v1::UpdateBatch moves(uint64_t tick) const;

 private:
  struct DemoObject {
    ShapeKind kind;
    Vec3f start;     // relative to the frame
    Vec3f velocity;  // a tick
    Vec3f size;
    float radius;
    Quaternion rotation;
  };

  Vec3f offset(const DemoObject& object, uint64_t tick) const;

  Aabbd bounds_;
  Vec3d frame_;
  Vec3f half_;  // of the bounds, around the frame
  std::vector<DemoObject> objects_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_DEMO_DEMO_WORLD_H_
