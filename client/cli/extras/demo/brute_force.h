// Reference evaluation of queries by brute force: tests every triangle and every object with the server's predicates,
// but without its index structures. The server's answers must equal the answers of this evaluation bit for bit.
// Immutable; threads may share one object.
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

// Mesh placed in the scene, with its triangles in the mesh's own axes.
struct CheckedInstance {
  uint64_t id;
  Transform transform;
  std::vector<Triangle> triangles;  // in index order
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
  // Borrows both vectors, which must outlive this object.
  BruteForce(const std::vector<CheckedInstance>& instances, const std::vector<CheckedObject>& objects)
      : instances_(instances), objects_(objects) {}

  // Returns the answer to a ray query in mode FIRST with default options and without a maximum length. For a query in
  // mode ANY the answer is a hit if and only if the returned id is not 0.
  FirstHit first(Vec3d origin, Vec3d direction) const;
  // Return the answer to an overlap query with detail TRIANGLES_SORTED, in ascending order: a row (instance, triangle)
  // for each overlapping triangle, and a row (object, 0xFFFFFFFF) for each overlapping object.
  std::vector<OverlapRow> ball(const Balld& ball) const;
  std::vector<OverlapRow> box(const Obbd& box) const;

 private:
  const std::vector<CheckedInstance>& instances_;
  const std::vector<CheckedObject>& objects_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_DEMO_BRUTE_FORCE_H_
