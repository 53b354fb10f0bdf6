// Search by the vector kernels for the triangles of a mesh that overlap a ball or a box in mesh axes. Returns the
// triangles' indices in the uploaded mesh, in the order in which the tree stores the triangles. The results equal those
// of ball_overlaps() and box_overlaps(). find_triangles() answers many regions in one call. TriangleSearch answers one
// region in steps, so that the caller can stop between two steps:
//
//   if (TriangleSearch<Ballf>::served(tree, ball)) {
//     TriangleSearch<Ballf> search(tree, ball);
//     while (!search.over()) use(triangles, search.next(triangles, room));
//   } else {
//     tree.visit_region(...);
//   }
//
// Threads: a search belongs to one thread; any number of searches may share a tree.
#ifndef LOCUS_CORE_QUERY_KINDS_TRIANGLE_SEARCH_H_
#define LOCUS_CORE_QUERY_KINDS_TRIANGLE_SEARCH_H_

#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/geometry/triangle_overlap.h"
#include "core/index/bvh/kernels/dispatch.h"
#include "core/index/bvh/triangle_bvh.h"

namespace locus {

// Return a region in the representation of the kernels.
KernelBall kernel_region(const Ballf& ball);
KernelBox kernel_region(const Obbf& box);

// Return the overlap test of a region in double, which the kernels call for triangles whose overlap they cannot
// determine in float. The test borrows the region.
RegionPredicate predicate_of(const Ballf& ball);
RegionPredicate predicate_of(const Obbf& box);

// Return the kernel for a region. Precondition: active_region_kernels() is not null.
inline auto kernel_for(const Ballf& /*ball*/) { return active_region_kernels()->ball; }
inline auto kernel_for(const Obbf& box) {
  return box.rotation == Rotation{} ? active_region_kernels()->box : active_region_kernels()->turned_box;
}

// Return an upper bound of the largest |coordinate| of a region. The kernels support a region if the sum of this bound
// and the tree's magnitude is at most kMaxRegionReach.
inline float extent_of(const Ballf& ball) { return max_component(abs(ball.center)) + ball.radius; }
inline float extent_of(const Obbf& box) {
  return max_component(abs(box.center)) + box.half.x + box.half.y + box.half.z;
}

// Search for the triangles of one region, in steps. Shape is Ballf or Obbf. Borrows the tree and the shape.
template <class Shape>
class TriangleSearch {
 public:
  // Returns whether kernels exist and support this region and tree; an empty tree is not supported.
  static bool served(const TriangleBvh& tree, const Shape& shape) {
    return active_region_kernels() != nullptr && tree.size() != 0 &&
           extent_of(shape) + tree.tree().magnitude <= kMaxRegionReach;
  }

  // Precondition: served(tree, shape).
  TriangleSearch(const TriangleBvh& tree, const Shape& shape)
      : run_(kernel_for(shape).one), tree_(tree.tree()), region_(kernel_region(shape)) {
    LOCUS_DCHECK(served(tree, shape));
    visit_.start(predicate_of(shape));
  }

  // Returns whether all triangles have been returned.
  bool over() const { return visit_.over(); }
  // Writes the next triangle indices to `triangles` and returns their number. Each call stops after about
  // kMaxRegionTests tests, so a number below `room`, even 0, does not mean that the search is over. `room` is the
  // length of `triangles`, at least kMinRegionRoom; entries of `triangles` after the returned number may be
  // overwritten.
  size_t next(uint32_t* triangles, size_t room) {
    LOCUS_DCHECK(!over());
    LOCUS_DCHECK_GE(room, size_t{kMinRegionRoom});
    visit_.numbers = triangles;
    visit_.room = room;
    run_(tree_, region_, visit_);
    LOCUS_DCHECK_LE(visit_.found, room);
    return visit_.found;
  }
  // Return the cost of the last call of next(): the number of nodes opened, of triangles tested, and of triangles
  // tested in double because the test in float was not conclusive.
  uint32_t nodes() const { return visit_.nodes; }
  uint32_t tests() const { return visit_.tests; }
  uint32_t exact_tests() const { return visit_.exact_tests; }

 private:
  const decltype(kernel_for(std::declval<Shape>()).one) run_;
  const TriangleTree tree_;
  const decltype(kernel_region(std::declval<Shape>())) region_;
  RegionVisit visit_;
};

// Finds the triangles of many regions, with or without kernels. Writes the number of triangles of each region to
// `counts`, and the indices of these triangles to `triangles`. Returns the number of regions answered. All regions are
// answered unless `triangles` is too short. A length of tree.size() + kMinRegionRoom per region is always sufficient.
// `counts` has one entry per region.
size_t find_triangles(const TriangleBvh& tree, absl::Span<const Ballf> balls, absl::Span<uint32_t> counts,
                      absl::Span<uint32_t> triangles);
size_t find_triangles(const TriangleBvh& tree, absl::Span<const Obbf> boxes, absl::Span<uint32_t> counts,
                      absl::Span<uint32_t> triangles);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_TRIANGLE_SEARCH_H_
