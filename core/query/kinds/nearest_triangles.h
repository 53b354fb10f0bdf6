// Search by the vector kernels for the triangles of a mesh that are nearest to a point in mesh axes. The search runs in
// steps, so that the caller can measure the candidates of a step, lower the limit and stop between two steps:
//
//   NearestSearch search(tree, point, limit, NearestSearch::Find::kNearest, slack);
//   while (!search.over()) {
//     search.next();
//     for (uint32_t i = 0; i < search.found(); ++i) measure(search.triangle(i));
//     search.lower_limit(limit_of_the_rows);
//   }
//
// Candidates are a superset of the triangles to find: no triangle is missed because of rounding. Threads: a search
// belongs to one thread; any number of searches may share a tree.
#ifndef LOCUS_CORE_QUERY_KINDS_NEAREST_TRIANGLES_H_
#define LOCUS_CORE_QUERY_KINDS_NEAREST_TRIANGLES_H_

#include <algorithm>

#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/geometry/float_step.h"
#include "core/geometry/transform.h"
#include "core/index/bvh/kernels/dispatch.h"
#include "core/index/bvh/triangle_bvh.h"

namespace locus {

static_assert(kMaxNearestGroups == limits::kMaxBvhDepth);

class NearestSearch {
 public:
  // Triangles to find: all triangles within the limit, or only the nearest of them.
  enum class Find { kEvery, kNearest };

  // Returns whether a search is possible: kernels exist for the active instruction set, and support the tree and the
  // point.
  static bool served(const TriangleBvh& tree, Vec3d point) {
    return active_nearest_kernels() != nullptr && tree.size() != 0 &&
           max_component(abs(point)) + double{tree.tree().magnitude} <= double{kMaxNearestReach};
  }

  // Begins a search for the triangles at a distance of at most `limit`, in mesh axes; infinity is legal. With kNearest,
  // the search may omit triangles that are farther away than the nearest triangle by more than `slack` plus 2^-20 of
  // the distance of the nearest triangle. Precondition: served(tree, point).
  NearestSearch(const TriangleBvh& tree, Vec3d point, double limit, Find find, double slack = 0)
      : NearestSearch(*active_nearest_kernels(), tree, point, limit, find, slack) {
    LOCUS_DCHECK(served(tree, point));
  }
  // Begins the same search with `kernels` instead of the kernels of the active instruction set.
  NearestSearch(const NearestKernels& kernels, const TriangleBvh& tree, Vec3d point, double limit, Find find,
                double slack)
      : kernels_(kernels), bvh_(tree), tree_(tree.tree()) {
    LOCUS_DCHECK_GE(limit, 0.0);
    LOCUS_DCHECK_GE(slack, 0.0);
    for (int axis = 0; axis < 3; ++axis) visit_.point[axis] = static_cast<float>(point[axis]);
    // Rounding the point to float moves it by less than 2^-24 sqrt(3) times its largest coordinate.
    visit_.pad = static_cast<float>(0x1p-23 * max_component(abs(point)));
    visit_.limit = rounded_up(limit);
    visit_.closest = find == Find::kNearest;
    visit_.slack = rounded_up(slack);
    visit_.room = visit_.closest ? kMaxCandidates : 1;
    visit_.start();
  }

  // Returns whether all candidates have been returned.
  bool over() const { return visit_.over(); }
  // Finds the next candidates with at most about kMaxNearestTests tests. A call may find no candidate.
  void next() {
    LOCUS_DCHECK(!over());
    kernels_.run(tree_, visit_);
    LOCUS_DCHECK_LE(visit_.found, kMaxCandidates + kTreeWidth);
  }
  // Lowers the limit to `limit` if `limit` is lower than the current limit.
  void lower_limit(double limit) { visit_.limit = std::min(visit_.limit, rounded_up(limit)); }
  // Returns the limit, which a search with kNearest lowers when it finds a nearer triangle.
  float limit() const { return visit_.limit; }

  // Return the number of candidates that the last call of next() found, the number of nodes that it opened, and the
  // number of triangles that it tested.
  uint32_t found() const { return visit_.found; }
  uint32_t nodes() const { return visit_.nodes; }
  uint32_t tests() const { return visit_.tests; }
  // Return the triangle of candidate `i`, and its number in the uploaded mesh. Precondition: i < found().
  Triangle triangle(uint32_t i) const { return bvh_.triangle(block(i), lane(i)); }
  uint32_t number(uint32_t i) const { return tree_.numbers[block(i).first + lane(i)]; }

  // Array for the squared distances of all candidates that one call of next() can find.
  using Squared = double[kMaxCandidates + kTreeWidth];
  // Writes to `squared` the squared distance of each candidate from `point`, which is in world axes; `transform` places
  // the mesh in the world. A squared distance is the larger of the squared distance to the triangle and the squared
  // distance to the triangle's bounds grown by `epsilon`.
  void measure(Vec3d point, const Transform& transform, double epsilon, Squared& squared) const {
    const Rotation& rotation = transform.rotation;
    const Vec3d shift = transform.translation, x = rotation.row_x, y = rotation.row_y, z = rotation.row_z;
    const NearestPlacement placement = {{point.x, point.y, point.z},
                                        {shift.x, shift.y, shift.z},
                                        {x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z},
                                        double{transform.scale},
                                        epsilon};
    kernels_.measure(tree_, placement, visit_.candidates, visit_.found, squared);
  }

 private:
  static float rounded_up(double value) { return next_above(static_cast<float>(value)); }
  const TriangleBlock& block(uint32_t i) const {
    LOCUS_DCHECK_LT(i, visit_.found);
    return tree_.blocks[visit_.candidates[i].block];
  }
  uint32_t lane(uint32_t i) const { return visit_.candidates[i].lane; }

  const NearestKernels& kernels_;
  const TriangleBvh& bvh_;
  const TriangleTree tree_;
  NearestVisit visit_;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_NEAREST_TRIANGLES_H_
