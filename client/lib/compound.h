// Shape of a compound: up to 64 balls, boxes and capsules in the object's own axes, which move as one object. For
// callers of UpdateBuilder. Parts are numbered from 0 in the order in which they are added; answers name the part in
// the triangle column. The server checks the values. Not thread-safe.
//
//   const Compound rig = Compound()
//       .ball({0, 0, 1.7f}, 0.12f, {.layers = 2})          // part 0: the head
//       .capsule({0, 0, 1.2f}, {0, 0, 0.2f}, 0.25f);       // part 1: the chest
#ifndef LOCUS_CLIENT_LIB_COMPOUND_H_
#define LOCUS_CLIENT_LIB_COMPOUND_H_

#include <cstddef>
#include <cstdint>

#include "client/lib/values.h"
#include "locus/v1/geometry.pb.h"

namespace locus::client {

inline constexpr uint32_t kAllLayers = 0xFFFFFFFF;

// Optional properties of a part.
struct PartOptions {
  Rotation rotation = {};        // from the part's own axes to the object's axes
  uint32_t layers = kAllLayers;  // the part is in those layers that both the part and its object have
};

// Pose of a part in the axes of its object, for example of a bone.
struct PartPose {
  Float3 position;
  Rotation rotation = {};
};

class Compound {
 public:
  // Add one part. Positions are the centers of the parts, relative to the object's position, in the object's own axes.
  Compound& ball(const Float3& position, float radius, const PartOptions& options = {});
  Compound& box(const Float3& position, const Float3& half_extents, const PartOptions& options = {});
  // Adds a capsule. `half_axis` is the vector from the center to one end of the inner segment, in the part's own axes.
  Compound& capsule(const Float3& position, const Float3& half_axis, float radius, const PartOptions& options = {});

  // Returns the number of parts.
  size_t size() const;
  // Returns whether a part was given layers. Without labels, objects are then in all layers of their parts.
  bool has_layers() const;
  const v1::Compound& message() const { return message_; }

 private:
  v1::Parts& add(v1::Parts::ShapeCase shape, const Float3& position, const PartOptions& options);

  v1::Compound message_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_COMPOUND_H_
