// Visitor of the values of a grid's cells: passes each value once to the visitor of the grid and counts it.
#ifndef LOCUS_CORE_INDEX_GRID_CELL_VISITOR_H_
#define LOCUS_CORE_INDEX_GRID_CELL_VISITOR_H_

#include "core/base/planted_bug.h"
#include "core/index/cut_values.h"
#include "core/index/spatial_index.h"

namespace locus {

namespace internal {
// One object per visit; borrows its arguments.
template <class V, class T, class Visitor>
class CellVisitor {
 public:
  CellVisitor(Visitor& visitor, Work& work) : visitor_(visitor), work_(work) {}

  // Sets whether the next values may have been passed before, from other cells.
  void set_shared(bool shared) { shared_ = shared; }
  // For PlantedBug::kGridClippedToCell: passes only values for which clip(value) is true.
  void set_clip(const SlabRay<typename T::Scalar>* slabs, Interval<typename T::Scalar> cell) {
    clip_ = slabs;
    cell_ = cell;
  }
  bool ended() const { return ended_; }

  auto limit() const { return visitor_.limit(); }
  Aabb<typename T::Scalar> bounds() const { return visitor_.bounds(); }
  bool overlaps(const Aabb<typename T::Scalar>& box) const { return visitor_.overlaps(box); }
  bool visit(const V& value) {
    if (planted(PlantedBug::kGridClippedToCell) && clipped_away(value)) return true;
    if (shared_ && !passed_.add(T::id(value)) && !planted(PlantedBug::kGridPassedTwice)) return true;
    ++work_.tests;
    ended_ = !visitor_.visit(value);
    return !ended_;
  }

 private:
  bool clipped_away(const V& value) const {
    if (clip_ == nullptr) return false;
    const auto near = clip_->interval(T::bounds(value)).near;
    return near > 0 && (near < cell_.near || near > cell_.far);
  }

  Visitor& visitor_;
  Work& work_;
  bool shared_ = false;
  bool ended_ = false;
  PassedValues passed_;
  const SlabRay<typename T::Scalar>* clip_ = nullptr;
  Interval<typename T::Scalar> cell_ = {};
};
}  // namespace internal

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_GRID_CELL_VISITOR_H_
