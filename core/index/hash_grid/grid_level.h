// One level of the hash grid: the bricks of one cell size, found by hash, and the two ways to visit them. A value type
// with copies in O(1) that share everything; threads as for PersistentMap.
//
// Invariants: every value within the level lies in the brick and cell of its position; no brick is empty; extent()
// covers every value (it may be larger, since it does not shrink until the level is empty).
#ifndef LOCUS_CORE_INDEX_HASH_GRID_GRID_LEVEL_H_
#define LOCUS_CORE_INDEX_HASH_GRID_GRID_LEVEL_H_

#include <algorithm>
#include <memory>
#include <utility>

#include "absl/container/inlined_vector.h"
#include "core/base/persistent_map.h"
#include "core/index/hash_grid/brick.h"
#include "core/index/hash_grid/cell_key.h"
#include "core/index/hash_grid/slab_march.h"
#include "core/index/spatial_index.h"

namespace locus::internal {

template <Bounded V>
class GridLevel {
  using Traits = PrimitiveTraits<V>;

 public:
  explicit GridLevel(int exponent) : exponent_(exponent) { extent_.cells_per_unit = cells_per_unit(exponent); }

  int exponent() const { return exponent_; }
  size_t size() const { return size_; }
  size_t bricks() const { return bricks_.size(); }
  const LevelExtent& extent() const { return extent_; }

  // Null when nothing is there.
  const Brick<V>* find(const GridKey& key) const {
    const std::shared_ptr<const Brick<V>>* found = bricks_.find(key);
    return found == nullptr ? nullptr : found->get();
  }
  // Puts `brick` in place of what is there; an empty one is taken out. `added` and `removed` values make the
  // difference.
  void replace(const GridKey& key, Brick<V> brick, size_t added, size_t removed);
  // Before a value that sticks out this far is put in.
  void extend(const Aabbd& bounds, double reach) {
    extent_.bounds = merge(extent_.bounds, bounds);
    extent_.reach = std::max(extent_.reach, reach);
  }

  // fn(key, brick) for every brick.
  template <class Fn>
  void for_each_brick(Fn&& fn) const {
    bricks_.for_each([&fn](const GridKey& key, const std::shared_ptr<const Brick<V>>& brick) { fn(key, *brick); });
  }

  // As SpatialIndex asks; false once the visitor has ended the visit.
  template <RayVisitor<V> Visitor>
  bool visit_ray(const SlabRay<double>& ray, Visitor& visitor, Work& work) const;
  template <RegionVisitor<V> Visitor>
  bool visit_region(Visitor& visitor, Work& work) const;

 private:
  static bool within(const Interval<double>& part, double limit) {
    return part.near <= part.far && part.far >= 0 && part.near <= limit;
  }
  template <class Visitor>
  static bool visit_brick_on_ray(const Brick<V>& brick, const SlabRay<double>& ray, Visitor& visitor, Work& work);
  template <class Visitor>
  static bool visit_brick_in_region(const Brick<V>& brick, Visitor& visitor, Work& work);
  template <class Visitor>
  bool march(const SlabMarch& slabs, const SlabRay<double>& ray, Visitor& visitor, Work& work) const;
  // For rays that would name more bricks than there are.
  template <class Visitor>
  bool visit_all_by_distance(const SlabRay<double>& ray, Visitor& visitor, Work& work) const;
  // Bricks whose values may overlap `region`.
  BrickRange bricks_near(const Aabbd& region) const;
  // fn(brick) for those of the range that exist, until fn returns false, which is then returned.
  template <class Fn>
  bool for_each_in(const BrickRange& range, Work& work, const Fn& fn) const;

  int exponent_;
  size_t size_ = 0;
  LevelExtent extent_;
  PersistentMap<GridKey, std::shared_ptr<const Brick<V>>, GridKeyHash> bricks_;
};

template <Bounded V>
void GridLevel<V>::replace(const GridKey& key, Brick<V> brick, size_t added, size_t removed) {
  size_ = size_ + added - removed;
  if (brick.empty()) {
    bricks_.erase(key);
  } else {
    brick.update_bounds();
    bricks_.set(key, std::make_shared<const Brick<V>>(std::move(brick)));
  }
}

template <Bounded V>
template <RayVisitor<V> Visitor>
bool GridLevel<V>::visit_ray(const SlabRay<double>& ray, Visitor& visitor, Work& work) const {
  const SlabMarch slabs(ray, extent_, std::as_const(visitor).limit());
  if (slabs.bricks() > static_cast<double>(bricks_.size())) return visit_all_by_distance(ray, visitor, work);
  return march(slabs, ray, visitor, work);
}

template <Bounded V>
template <class Visitor>
bool GridLevel<V>::march(const SlabMarch& slabs, const SlabRay<double>& ray, Visitor& visitor, Work& work) const {
  for (int64_t n = 0; n < slabs.slabs(); ++n) {
    const double limit = std::as_const(visitor).limit();
    const SlabMarch::Slab slab = slabs.slab(n, limit);
    if (slab.near > limit) break;
    const bool go_on = for_each_in(
        slab.bricks, work, [&](const Brick<V>& brick) { return visit_brick_on_ray(brick, ray, visitor, work); });
    if (!go_on) return false;
  }
  return true;
}

template <Bounded V>
template <class Visitor>
bool GridLevel<V>::visit_all_by_distance(const SlabRay<double>& ray, Visitor& visitor, Work& work) const {
  struct Candidate {
    double near;
    const Brick<V>* brick;
  };
  absl::InlinedVector<Candidate, 32> candidates;
  const double limit = std::as_const(visitor).limit();
  for_each_brick([&](const GridKey&, const Brick<V>& brick) {
    ++work.cells;
    const Interval<double> part = ray.interval(brick.bounds);
    if (within(part, limit)) candidates.push_back({part.near, &brick});
  });
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.near < b.near; });
  for (const Candidate& candidate : candidates) {
    if (candidate.near > std::as_const(visitor).limit()) break;
    if (!visit_brick_on_ray(*candidate.brick, ray, visitor, work)) return false;
  }
  return true;
}

template <Bounded V>
template <class Visitor>
bool GridLevel<V>::visit_brick_on_ray(const Brick<V>& brick, const SlabRay<double>& ray, Visitor& visitor, Work& work) {
  const auto reaches = [&](const Aabbd& box) { return within(ray.interval(box), std::as_const(visitor).limit()); };
  return !reaches(brick.bounds) || brick.visit(ray.direction().z < 0, reaches, work,
                                               [&](const auto& entry) { return visitor.visit(entry.value); });
}

template <Bounded V>
template <RegionVisitor<V> Visitor>
bool GridLevel<V>::visit_region(Visitor& visitor, Work& work) const {
  const auto visit_brick = [&](const Brick<V>& brick) { return visit_brick_in_region(brick, visitor, work); };
  const BrickRange range = bricks_near(std::as_const(visitor).bounds());
  if (range.empty()) return true;
  if (range.count() <= static_cast<double>(bricks_.size())) return for_each_in(range, work, visit_brick);
  bool go_on = true;
  for_each_brick([&](const GridKey&, const Brick<V>& brick) {
    if (!go_on) return;
    ++work.cells;
    go_on = visit_brick(brick);
  });
  return go_on;
}

template <Bounded V>
template <class Visitor>
bool GridLevel<V>::visit_brick_in_region(const Brick<V>& brick, Visitor& visitor, Work& work) {
  const auto reaches = [&](const Aabbd& box) { return std::as_const(visitor).overlaps(box); };
  return !reaches(brick.bounds) ||
         brick.visit(false, reaches, work, [&](const auto& entry) { return visitor.visit(entry.value); });
}

template <Bounded V>
BrickRange GridLevel<V>::bricks_near(const Aabbd& region) const {
  if (!overlaps(region, extent_.bounds)) return {{0, 0, 0}, {-1, -1, -1}};
  // Positions lie within the extent, so that the figures below are finite; the factor covers their rounding.
  const Aabbd inside{max(region.min, extent_.bounds.min), min(region.max, extent_.bounds.max)};
  const double reach = extent_.reach + 0x1p-50 * (extent_.reach + magnitude(inside));
  const Aabbd near = grown(inside, reach);
  return bricks_within({max(near.min, extent_.bounds.min), min(near.max, extent_.bounds.max)}, extent_.cells_per_unit);
}

template <Bounded V>
template <class Fn>
bool GridLevel<V>::for_each_in(const BrickRange& range, Work& work, const Fn& fn) const {
  for (int64_t z = range.lo.z; z <= range.hi.z; ++z) {
    for (int64_t y = range.lo.y; y <= range.hi.y; ++y) {
      for (int64_t x = range.lo.x; x <= range.hi.x; ++x) {
        ++work.cells;
        const Brick<V>* brick = find({x, y, z});
        if (brick != nullptr && !fn(*brick)) return false;
      }
    }
  }
  return true;
}

}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_GRID_LEVEL_H_
