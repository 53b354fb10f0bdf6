// Search by the vector kernels for the winding number of a closed mesh around a point, which is in mesh axes. The
// search follows the half line of a WindingWay. It runs in steps, so that the caller can stop between two steps:
//
//   WindingSearch search(tree, point, cells.way_from(tree, point));
//   while (!search.over()) search.next();
//   use(search.winds_around());
//
// The result equals the sum of crossing() along a half line over all triangles. Threads: a search belongs to one
// thread; any number of searches may share a tree.
#ifndef LOCUS_CORE_QUERY_KINDS_WINDING_SEARCH_H_
#define LOCUS_CORE_QUERY_KINDS_WINDING_SEARCH_H_

#include "core/base/check.h"
#include "core/geometry/point_in_mesh.h"
#include "core/index/bvh/kernels/dispatch.h"
#include "core/index/bvh/triangle_bvh.h"
#include "core/index/bvh/winding_cells.h"

namespace locus {

class WindingSearch {
 public:
  // Returns whether a search is possible: kernels exist for the active instruction set, and the tree is not empty.
  static bool served(const TriangleBvh& tree) { return active_crossing_kernels() != nullptr && tree.size() != 0; }

  // Begins a search along `way`. `point` must be a result of without_tiny_coordinates(). Preconditions: served(tree),
  // and way.is_known is false.
  WindingSearch(const TriangleBvh& tree, Vec3d point, const WindingWay& way)
      : WindingSearch(*active_crossing_kernels(), tree, point, way) {
    LOCUS_DCHECK(served(tree));
  }
  // Begins the same search with `kernels` instead of the kernels of the active instruction set.
  WindingSearch(const CrossingKernels& kernels, const TriangleBvh& tree, Vec3d point, const WindingWay& way)
      : kernels_(kernels), bvh_(tree), tree_(tree.tree()), point_(point), way_(way) {
    LOCUS_DCHECK(!way.is_known);
    visit_.line = HalfLineBoxes(point, way.line, way.end).floats();
    visit_.predicate = {exact_crossing, this};
    visit_.start();
  }
  // Cannot be copied, because the kernel calls exact_crossing() with a pointer to this object.
  WindingSearch(const WindingSearch&) = delete;
  WindingSearch& operator=(const WindingSearch&) = delete;

  // Returns whether the search is complete.
  bool over() const { return visit_.over(); }
  // Continues the search by at most about kMaxCrossingWork nodes and tests.
  void next() {
    LOCUS_DCHECK(!over());
    kernels_.run(tree_, visit_);
  }

  // Return the cost of the last call of next(): the number of nodes opened, of triangles tested, and of triangles for
  // which crossing() was called.
  uint32_t nodes() const { return visit_.nodes; }
  uint32_t tests() const { return visit_.tests; }
  uint32_t exact_tests() const { return visit_.exact_tests; }
  // Return the result of a complete search. The winding number is only known if the point is not on the surface.
  bool on_surface() const { return visit_.on_surface; }
  int64_t winding() const { return way_.winding + visit_.winding; }
  bool winds_around() const { return on_surface() || winding() != 0; }

 private:
  static int exact_crossing(const void* context, const TriangleBlock& block, uint32_t lane) {
    const auto& search = *static_cast<const WindingSearch*>(context);
    const Crossing found = crossing(search.point_, search.bvh_.triangle(block, lane), search.way_.line);
    return found.on_surface ? kOnTriangle : found.winding;
  }

  const CrossingKernels& kernels_;
  const TriangleBvh& bvh_;
  const TriangleTree tree_;
  const Vec3d point_;
  const WindingWay way_;
  CrossingVisit visit_;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_WINDING_SEARCH_H_
