// Answers by trying everything: every triangle and every object, with the same predicates as the server and none of its
// structures. What the server answers must equal this bit for bit. Immutable; threads may share one.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_DEMO_BRUTE_FORCE_H_
#define LOCUS_CLIENT_CLI_EXTRAS_DEMO_BRUTE_FORCE_H_

#include <compare>
#include <limits>
#include <vector>

#include "core/geometry/ball.h"
#include "core/geometry/obb.h"
#include "core/geometry/ray_triangle.h"
#include "core/geometry/shape.h"
#include "core/geometry/transform.h"

namespace locus::cli {

// One placed mesh.
struct CheckedInstance {
  uint64_t id;
  Transform transform;
  std::vector<Triangle> triangles;  // by number
  Aabbf mesh_bounds;
};

struct CheckedObject {
  uint64_t id;
  Shape shape;
};

struct FirstHit {
  float t = std::numeric_limits<float>::infinity();
  uint64_t id = 0;
  uint32_t triangle = 0xFFFFFFFFu;

  friend auto operator<=>(const FirstHit&, const FirstHit&) = default;
};

struct OverlapRow {
  uint64_t id;
  uint32_t triangle;

  friend auto operator<=>(const OverlapRow&, const OverlapRow&) = default;
};

class BruteForce {
 public:
  // Both are borrowed.
  BruteForce(const std::vector<CheckedInstance>& instances, const std::vector<CheckedObject>& objects)
      : instances_(instances), objects_(objects) {}

  // As FIRST with every option at its default and no end. ANY is whether the id is not 0.
  FirstHit first(Vec3d origin, Vec3d direction) const;
  // As TRIANGLES_SORTED: (instance, triangle) and (object, no triangle), ascending.
  std::vector<OverlapRow> ball(const Balld& ball) const;
  std::vector<OverlapRow> box(const Obbd& box) const;

 private:
  const std::vector<CheckedInstance>& instances_;
  const std::vector<CheckedObject>& objects_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_DEMO_BRUTE_FORCE_H_
