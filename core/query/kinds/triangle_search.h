// All triangles of a mesh that a ball or a box in mesh axes meets, by the vector kernels: their numbers, in storage
// order, decided as ball_overlaps() and box_overlaps() decide. For whoever wants numbers and no visitor;
// find_triangles() for whole batches, TriangleSearch for whoever wants to look up between runs of them:
//
//   if (TriangleSearch<Ballf>::served(tree, ball)) {
//     TriangleSearch<Ballf> search(tree, ball);
//     while (!search.over()) use(numbers, search.next(numbers, room));
//   } else {
//     tree.visit_region(...);
//   }
//
// Threads: a search belongs to one thread; the tree may serve many.
#ifndef LOCUS_CORE_QUERY_KINDS_TRIANGLE_SEARCH_H_
#define LOCUS_CORE_QUERY_KINDS_TRIANGLE_SEARCH_H_

#include "absl/types/span.h"
#include "core/geometry/triangle_overlap.h"
#include "core/index/bvh/kernels/dispatch.h"
#include "core/index/bvh/triangle_bvh.h"

namespace locus {

// The regions as kernels want them.
KernelBall kernel_region(const Ballf& ball);
KernelBox kernel_region(const Obbf& box);

// The predicates, for what float leaves open.
RegionJudge judge_of(const Ballf& ball);
RegionJudge judge_of(const Obbf& box);

// The kernel for a region; not without kernels.
inline auto kernel_for(const Ballf& /*ball*/) { return active_region_kernels()->ball; }
inline auto kernel_for(const Obbf& box) {
  return box.rotation == Rotation{} ? active_region_kernels()->box : active_region_kernels()->turned_box;
}

// How far a region reaches from the origin of mesh axes; kernels serve up to kMaxRegionReach, the tree's included.
inline float reach_of(const Ballf& ball) { return max_component(abs(ball.center)) + ball.radius; }
inline float reach_of(const Obbf& box) { return max_component(abs(box.center)) + box.half.x + box.half.y + box.half.z; }

// Shape is Ballf or Obbf.
template <class Shape>
class TriangleSearch {
 public:
  // Whether there are kernels, and this is for them; not for an empty tree.
  static bool served(const TriangleBvh& tree, const Shape& shape) {
    return active_region_kernels() != nullptr && tree.size() != 0 &&
           reach_of(shape) + tree.tree().magnitude <= kMaxRegionReach;
  }

  TriangleSearch(const TriangleBvh& tree, const Shape& shape)
      : run_(kernel_for(shape).one), tree_(tree.tree()), region_(kernel_region(shape)) {
    visit_.start(judge_of(shape));
  }

  bool over() const { return visit_.over(); }
  // Writes the next numbers and returns how many: at most `room`, fewer while the search is not over. `room` is at
  // least kMinRegionRoom; all of it may be written to. Ends after kMaxRegionTests tests or so.
  size_t next(uint32_t* numbers, size_t room) {
    visit_.numbers = numbers;
    visit_.room = room;
    run_(tree_, region_, visit_);
    return visit_.found;
  }
  // Of the last next(): nodes opened and triangles tested, and of these how many by the predicates.
  uint32_t nodes() const { return visit_.nodes; }
  uint32_t tests() const { return visit_.tests; }
  uint32_t judged() const { return visit_.judged; }

 private:
  const decltype(kernel_for(std::declval<Shape>()).one) run_;
  const TriangleTree tree_;
  const decltype(kernel_region(std::declval<Shape>())) region_;
  RegionVisit visit_;
};

// Answers regions in order: the count of each, and its numbers behind those of the one before. Returns how many regions
// are answered: all, unless `numbers` is too short; it has room for all of them if it has tree.size() + kMinRegionRoom
// for each. Kernels or not.
size_t find_triangles(const TriangleBvh& tree, absl::Span<const Ballf> balls, absl::Span<uint32_t> counts,
                      absl::Span<uint32_t> numbers);
size_t find_triangles(const TriangleBvh& tree, absl::Span<const Obbf> boxes, absl::Span<uint32_t> counts,
                      absl::Span<uint32_t> numbers);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_TRIANGLE_SEARCH_H_
