// Snapshot of the hash grid: the structure that readers query. Immutable; copied in O(levels); any thread. A snapshot
// only culls: it passes each value that may satisfy a query to the caller once, and the caller applies the exact
// predicate of the value in double.
//
// A value is stored in the one cell that contains its position, on a level whose cells are at least as wide as the
// value. A query therefore widens its range on each level by the largest extent of that level, so that the query
// misses no value. This extent is at most half a cell, unless a value is wider than the cells of the coarsest possible
// level. A large value does not widen the range on other levels. Levels are visited from coarse to fine, so that a hit
// on a large near value shortens a ray before the many small values are tested. Source: Ericson, Real-Time Collision
// Detection, 2005, 7.2 (one cell per value); Schornbaum, Hierarchical Hash Grids for Coupled Particle Simulations,
// 2009.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_GRID_SNAPSHOT_H_
#define LOCUS_CORE_INDEX_HASH_GRID_GRID_SNAPSHOT_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "core/base/check.h"
#include "core/base/persistent_array.h"
#include "core/index/hash_grid/brick_scan.h"
#include "core/index/hash_grid/brick_table.h"
#include "core/index/hash_grid/nearest_walk.h"

namespace locus {

struct GridStatistics {
  size_t values = 0;
  size_t levels = 0;
  size_t bricks = 0;
  size_t cells = 0;      // occupied cells
  double cell_size = 0;  // cell edge of the base level
  size_t bytes = 0;      // memory of bricks, values and brick tables, whether shared with other snapshots or not
};

namespace internal {

inline constexpr size_t kBricksPerLeaf = 64;
using BrickArray = PersistentArray<BrickPtr, kBricksPerLeaf>;
// Index of the brick of each value, indexed by handle.
using BrickIndices = PersistentArray<uint32_t, 1024>;

struct GridLevel {
  int exponent = 0;        // cell edge = 2^exponent
  LevelGeometry geometry;  // its bounds contain all values, and may be larger
  size_t size = 0;         // number of values
  std::shared_ptr<const BrickTable> table;
};

// Returns the cells of `level` in which a value whose bounds overlap `region` may be stored.
KeyRange cells_near(const GridLevel& level, const Aabbd& region);
// Returns the part of the range of cells `range` that lies in the brick with the key `brick`, in coordinates relative
// to that brick, 0 to 3.
KeyRange within_brick(const KeyRange& range, const GridKey& brick);

}  // namespace internal

// Position of an iteration by for_each_from(). Valid only for the snapshot on which the iteration runs.
struct GridCursor {
  size_t brick = 0;
  size_t values = 0;  // number of values of the brick at `brick` that have been visited
};

// Bounds of the values of one brick.
struct GridBrickBounds {
  Aabbd positions;   // contains the positions of all values
  float max_extent;  // upper bound of the values' extents
};

class GridSnapshot {
 public:
  GridSnapshot() = default;
  GridSnapshot(std::vector<internal::GridLevel> levels, internal::BrickArray bricks,
               internal::BrickIndices bricks_by_handle, double cell_size);

  size_t size() const { return size_; }
  // Returns the cell edge of the base level.
  double cell_size() const { return cell_size_; }
  // Return the number of levels, and the number of bricks of all levels. O(levels).
  size_t level_count() const { return levels_.size(); }
  size_t brick_count() const;

  // Calls visit(GridRef) for every value whose bounds overlap `region`, and for some other values near the region. Ends
  // if visit() returns false. With `marks`, GridRef::is_inside() returns true for most values whose positions are
  // inside.
  template <class Visit>
  void visit_region(const Aabbd& region, Work& work, const Visit& visit, Marks marks = Marks::kNone) const;
  // Calls visit(GridRef) for every value that shares a point with the ball, and for some other values near the ball.
  // Ends if visit() returns false. `bounds` are the bounds of the ball. Visits fewer values than visit_region(bounds):
  // a value whose bounds overlap `bounds` may still be culled.
  template <class Visit>
  void visit_ball(const Balld& ball, const Aabbd& bounds, Work& work, const Visit& visit,
                  Marks marks = Marks::kNone) const;
  // Calls fn(brick, cells) for each brick that visit_region(region) would scan; `cells` are the cells to scan, relative
  // to the brick. Returns false, possibly after some calls, if the region may need more than `max_bricks` bricks.
  template <class Fn>
  bool for_few_bricks(const Aabbd& region, size_t max_bricks, Work& work, const Fn& fn) const;

  // Calls visit(GridRef) for every value whose bounds have an interval on the ray with near <= far, far >= 0 and near
  // <= limit(), and for some other values near the ray. The order on each level is roughly from near to far. limit()
  // may decrease during the visit. Ends if visit() returns false. `displacement_bound` is an upper bound of the
  // distance between the true and the stored position of a value.
  template <class Limit, class Visit>
  void visit_ray(const SlabRay<double>& ray, const Limit& limit, Work& work, const Visit& visit,
                 double displacement_bound = 0) const;

  // Calls visit(GridRef) for every value whose bounds have a squared_distance() of at most limit() from `point`, and
  // for some other values near the point. The order on each level is roughly from near to far; the finest level
  // with a brick at the point is visited first. limit() may decrease during the visit. Ends if visit() returns false.
  // The cost on each level is proportional to the number of cells within the final limit() plus the number of values in
  // these cells. If the range of these cells has more than 1024 brick keys, and more than the level has bricks, each
  // brick of the level is tested once instead.
  template <class Limit, class Visit>
  void visit_nearest(const Vec3d& point, const Limit& limit, Work& work, const Visit& visit) const;

  // Calls visit(GridRef) for each value. Stops and returns false if visit() returns false.
  template <class Visit>
  bool for_each(const Visit& visit) const;
  // Continues an iteration over all values at `cursor`: calls visit(GridRef) for each further value until visit()
  // returns false, and advances the cursor past each visited value. So a long iteration can be split into steps.
  // Returns false if visit() returned false. O(visited values + values of the brick at the cursor).
  template <class Visit>
  bool for_each_from(GridCursor& cursor, const Visit& visit) const;

  // Returns the value of a handle. Precondition: the handle is in use in this snapshot. O(values in its brick).
  GridRef at(uint32_t handle) const;
  // Returns the value of a handle, or an empty reference if the handle is not in use in this snapshot. O(values in a
  // brick).
  GridRef find(uint32_t handle) const;
  // Returns find(value.handle()) for a value of another snapshot of the same grid. Faster than find() if the slot of
  // the value in this snapshot is close to its slot in the other snapshot.
  GridRef find_like(const GridRef& value) const;

  // Returns the version of the brick `other`, of another snapshot of the same grid, in this snapshot. Returns null if
  // this snapshot has no such brick, or if the version is the same. Another brick may have taken its index.
  const internal::Brick* version_of(const internal::Brick& other) const {
    const internal::Brick* const brick = other.index < bricks_.size() ? bricks_[other.index].get() : nullptr;
    return brick == &other ? nullptr : brick;
  }

  // Returns bounds of the values of a brick; `brick` is GridRef::brick() of one of them. O(1).
  GridBrickBounds brick_bounds(uint32_t brick) const;

  // Returns the union of bounds_of(value) over all values, an Aabbd that is empty for an empty snapshot.
  // bounds_of(GridRef) returns the bounds of a value, which lie within its extent. Cost: O(bricks), the values of a few
  // bricks, and those of the cells at the sides; values that are certainly not at a side are only culled in float or
  // not visited at all. If very many (131,072) values may lie at one side, visits at most twice as many as there are.
  template <class BoundsOf>
  Aabbd bounds(const BoundsOf& bounds_of, Work& work) const;

  // Returns counts and memory of this snapshot. O(values).
  GridStatistics statistics() const;
  // Returns the size in bytes of the parts of this snapshot that are not shared with `other`, another snapshot of the
  // same grid. O(bricks that differ).
  size_t unshared_bytes(const GridSnapshot& other) const;

 private:
  // Checks the order and the sizes of the levels. O(levels).
  void check_invariants() const;
  // Returns a box that contains the bounds of all values: the union of the boxes of all bricks, each grown by the
  // largest extent of its values. Writes to `extreme` the brick whose box extends farthest on each side: low x, y, z,
  // high x, y, z. Precondition: the snapshot is not empty.
  Aabbd outer_bounds(std::array<const internal::Brick*, 6>& extreme) const;
  const internal::Brick* find_brick(const internal::GridLevel& level, const internal::GridKey& key) const;
  static GridRef find_in(const internal::Brick& brick, uint32_t handle);
  // Calls fn(brick) for the existing bricks in the range `bricks` of keys. Stops and returns false if fn() returns
  // false. Looks up each key or, if the level has fewer bricks than the range has keys, iterates over the bricks of the
  // level.
  template <class Fn>
  bool for_each_brick(const internal::GridLevel& level, const internal::KeyRange& bricks, Work& work,
                      const Fn& fn) const;
  // Visits the values in the cells near `region` that the culling function cull_of(brick) does not drop (see
  // scan_rows()).
  template <class CullOf, class Visit>
  void visit_cells(const Aabbd& region, Work& work, const CullOf& cull_of, const Visit& visit) const;
  // Visits the bricks of one level slab by slab. Returns false if visit() returned false.
  template <class Limit, class Visit>
  bool march(const internal::GridLevel& level, const internal::SlabMarch& slabs, double ray_radius,
             const SlabRay<double>& ray, const Limit& limit, Work& work, const Visit& visit) const;
  // Returns the estimated number of values per cell of `level` near `point`.
  double values_per_cell(const internal::GridLevel& level, const Vec3d& point) const;
  // Returns the finest level with a brick that contains `point`; null if there is none, or if there is only one level.
  // The values nearest to the point are most likely on this level, so that visits of the other levels end early.
  const internal::GridLevel* level_at(const Vec3d& point) const;
  // Visits the values of one level near `point`. Returns false if visit() returned false.
  template <class Limit, class Visit>
  bool visit_nearest_on(const internal::GridLevel& level, const Vec3d& point, const Limit& limit, Work& work,
                        const Visit& visit) const;
  // Visits the values of the present shell and of all later shells brick by brick, from near to far. Used if the range
  // of a shell has more than 1024 brick keys, and more than the level has bricks. Returns false if visit() returned
  // false.
  template <class Limit, class Visit>
  bool visit_nearest_bricks(const internal::GridLevel& level, const internal::NearestShells& shells, const Vec3d& point,
                            const Limit& limit, Work& work, const Visit& visit) const;
  // Visits all bricks of a level that the ray hits, from near to far. Used if march() would look up more keys than the
  // level has bricks. Returns false if visit() returned false.
  template <class Limit, class Visit>
  bool visit_by_distance(const internal::GridLevel& level, double max_extent, double ray_radius,
                         const SlabRay<double>& ray, const Limit& limit, Work& work, const Visit& visit) const;

  std::vector<internal::GridLevel> levels_;  // levels from coarse to fine
  internal::BrickArray bricks_;
  internal::BrickIndices bricks_by_handle_;
  size_t size_ = 0;
  double cell_size_ = 0;
};

inline size_t GridSnapshot::brick_count() const {
  size_t bricks = 0;
  for (const internal::GridLevel& level : levels_) bricks += level.table->size();
  return bricks;
}

inline const internal::Brick* GridSnapshot::find_brick(const internal::GridLevel& level,
                                                       const internal::GridKey& key) const {
  const uint32_t index =
      level.table->find(key, [&](uint32_t candidate) { return bricks_[candidate]->geometry.key == key; });
  return index == internal::BrickTable::kNone ? nullptr : bricks_[index].get();
}

template <class Fn>
bool GridSnapshot::for_each_brick(const internal::GridLevel& level, const internal::KeyRange& bricks, Work& work,
                                  const Fn& fn) const {
  if (bricks.empty()) return true;
  if (bricks.count() > static_cast<double>(level.table->size())) {
    work.cells += level.table->size();
    return level.table->for_each([&](uint32_t index) {
      const internal::Brick& brick = *bricks_[index];
      return !bricks.contains(brick.geometry.key) || fn(brick);
    });
  }
  for (int64_t z = bricks.lo.z; z <= bricks.hi.z; ++z) {
    for (int64_t y = bricks.lo.y; y <= bricks.hi.y; ++y) {
      for (int64_t x = bricks.lo.x; x <= bricks.hi.x; ++x) {
        ++work.cells;
        const internal::Brick* brick = find_brick(level, {x, y, z});
        if (brick != nullptr && !fn(*brick)) return false;
      }
    }
  }
  return true;
}

template <class Visit>
void GridSnapshot::visit_region(const Aabbd& region, Work& work, const Visit& visit, Marks marks) const {
  visit_cells(region, work, internal::BoxCull(region, marks), visit);
}

template <class Visit>
void GridSnapshot::visit_ball(const Balld& ball, const Aabbd& bounds, Work& work, const Visit& visit,
                              Marks marks) const {
  visit_cells(bounds, work, internal::BallCull(ball, marks), visit);
}

template <class Fn>
bool GridSnapshot::for_few_bricks(const Aabbd& region, size_t max_bricks, Work& work, const Fn& fn) const {
  size_t left = max_bricks;
  for (const internal::GridLevel& level : levels_) {
    const internal::KeyRange cells = internal::cells_near(level, region);
    const internal::KeyRange bricks = internal::bricks_of(cells);
    if (bricks.empty()) continue;
    if (bricks.count() > static_cast<double>(left)) return false;
    LOCUS_DCHECK_LE(left, max_bricks);
    for_each_brick(level, bricks, work, [&](const internal::Brick& brick) {
      fn(brick, internal::within_brick(cells, brick.geometry.key));
      --left;
      return true;
    });
  }
  return true;
}

template <class CullOf, class Visit>
void GridSnapshot::visit_cells(const Aabbd& region, Work& work, const CullOf& cull_of, const Visit& visit) const {
  for (const internal::GridLevel& level : levels_) {
    const internal::KeyRange cells = internal::cells_near(level, region);
    const bool keep_going = for_each_brick(level, internal::bricks_of(cells), work, [&](const internal::Brick& brick) {
      const auto cull = cull_of(brick);
      return internal::scan_cells(brick, internal::within_brick(cells, brick.geometry.key), work, cull, visit) &&
             internal::scan_recent(brick, work, cull, visit);
    });
    if (!keep_going) return;
  }
}

template <class Limit, class Visit>
void GridSnapshot::visit_ray(const SlabRay<double>& ray, const Limit& limit, Work& work, const Visit& visit,
                             double displacement_bound) const {
  LOCUS_DCHECK_GE(displacement_bound, 0.0);
  for (const internal::GridLevel& level : levels_) {
    internal::LevelGeometry geometry = level.geometry;
    if (displacement_bound > 0) {
      geometry.max_extent += displacement_bound;
      geometry.bounds = grown(geometry.bounds, displacement_bound);
    }
    const internal::SlabMarch slabs(ray, geometry, limit());
    const double ray_radius = displacement_bound + 2 * ray.margin(magnitude(geometry.bounds));
    const bool keep_going = slabs.bricks() > static_cast<double>(level.table->size())
                                ? visit_by_distance(level, geometry.max_extent, ray_radius, ray, limit, work, visit)
                                : march(level, slabs, ray_radius, ray, limit, work, visit);
    if (!keep_going) return;
  }
}

template <class Limit, class Visit>
bool GridSnapshot::march(const internal::GridLevel& level, const internal::SlabMarch& slabs, double ray_radius,
                         const SlabRay<double>& ray, const Limit& limit, Work& work, const Visit& visit) const {
  constexpr int kLayers = 1 << internal::kBrickBits;
  const GridKernels& kernels = active_grid_kernels();
  struct CrossedBrick {
    const internal::Brick* brick;
    internal::CullRay ray;
  };
  absl::InlinedVector<CrossedBrick, 16> crossed;
  for (int64_t n = 0; n < slabs.slabs(); ++n) {
    const internal::SlabMarch::Slab slab = slabs.slab(n, limit());
    if (slab.near > limit()) return true;
    crossed.clear();
    for_each_brick(level, slab.bricks, work, [&](const internal::Brick& brick) {
      crossed.push_back({&brick, internal::CullRay(brick, ray, ray_radius)});
      return true;
    });
    for (CrossedBrick& entry : crossed) {
      entry.ray.end_at(limit());
      const auto cull = [&](const GridRows& rows, uint32_t* slots) {
        return kernels.cull_line(rows, entry.ray.line(), slots);
      };
      if (!internal::scan_recent(*entry.brick, work, cull, visit)) return false;
    }
    for (int layer_index = 0; layer_index < kLayers && !crossed.empty(); ++layer_index) {
      const internal::SlabMarch::Layer layer = slabs.layer(n, layer_index, limit());
      if (layer.near > limit()) return true;
      for (CrossedBrick& entry : crossed) {
        const internal::KeyRange cells = internal::within_brick(layer.cells, entry.brick->geometry.key);
        if (cells.empty()) continue;
        entry.ray.end_at(limit());
        const auto cull = [&](const GridRows& rows, uint32_t* slots) {
          return kernels.cull_line(rows, entry.ray.line(), slots);
        };
        if (!internal::scan_cells(*entry.brick, cells, work, cull, visit)) return false;
      }
    }
  }
  return true;
}

template <class Limit, class Visit>
bool GridSnapshot::visit_by_distance(const internal::GridLevel& level, double max_extent, double ray_radius,
                                     const SlabRay<double>& ray, const Limit& limit, Work& work,
                                     const Visit& visit) const {
  struct Candidate {
    double near;
    const internal::Brick* brick;
  };
  const GridKernels& kernels = active_grid_kernels();
  absl::InlinedVector<Candidate, 32> candidates;
  level.table->for_each([&](uint32_t index) {
    ++work.cells;
    const internal::Brick& brick = *bricks_[index];
    const Vec3d half = Vec3d{1, 1, 1} * (brick.geometry.edge / 2 + max_extent);
    const Interval<double> part = ray.interval({brick.geometry.center - half, brick.geometry.center + half});
    if (part.near <= part.far && part.far >= 0 && part.near <= limit()) candidates.push_back({part.near, &brick});
    return true;
  });
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.near < b.near; });
  for (const Candidate& candidate : candidates) {
    if (candidate.near > limit()) break;
    internal::CullRay cull_ray(*candidate.brick, ray, ray_radius);
    cull_ray.end_at(limit());
    const auto cull = [&](const GridRows& rows, uint32_t* slots) {
      return kernels.cull_line(rows, cull_ray.line(), slots);
    };
    if (!internal::scan_cells(*candidate.brick, internal::kAllCells, work, cull, visit) ||
        !internal::scan_recent(*candidate.brick, work, cull, visit))
      return false;
  }
  return true;
}

template <class Limit, class Visit>
void GridSnapshot::visit_nearest(const Vec3d& point, const Limit& limit, Work& work, const Visit& visit) const {
  const internal::GridLevel* const first = level_at(point);
  if (first != nullptr && !visit_nearest_on(*first, point, limit, work, visit)) return;
  for (const internal::GridLevel& level : levels_)
    if (&level != first && !visit_nearest_on(level, point, limit, work, visit)) return;
}

template <class Limit, class Visit>
bool GridSnapshot::visit_nearest_on(const internal::GridLevel& level, const Vec3d& point, const Limit& limit,
                                    Work& work, const Visit& visit) const {
  constexpr size_t kFewBricks = 1024;  // a shell with at most this many brick keys is always visited key by key
  internal::NearCandidates candidates;
  internal::NearestShells shells(point, level.geometry, values_per_cell(level, point));
  while (shells.next(limit())) {
    const internal::KeyRange cells = internal::cells_near(level, shells.region());
    const internal::KeyRange bricks = internal::bricks_of(cells);
    if (bricks.count() > static_cast<double>(std::max(level.table->size(), kFewBricks)))
      return visit_nearest_bricks(level, shells, point, limit, work, visit);
    for_each_brick(level, bricks, work, [&](const internal::Brick& brick) {
      candidates.collect(brick, internal::within_brick(cells, brick.geometry.key), point, shells.above(),
                         shells.up_to(), work);
      return true;
    });
    if (!candidates.visit(limit, work, visit)) return false;
  }
  return true;
}

template <class Limit, class Visit>
bool GridSnapshot::visit_nearest_bricks(const internal::GridLevel& level, const internal::NearestShells& shells,
                                        const Vec3d& point, const Limit& limit, Work& work, const Visit& visit) const {
  absl::InlinedVector<std::pair<double, const internal::Brick*>, 32> near;
  level.table->for_each([&](uint32_t index) {
    ++work.cells;
    const internal::Brick& brick = *bricks_[index];
    const double distance = squared_distance(point, internal::box_around_values(brick, level.geometry.max_extent));
    if (distance <= limit()) near.emplace_back(distance, &brick);
    return true;
  });
  const auto farther = [](const auto& a, const auto& b) { return a.first > b.first; };
  std::make_heap(near.begin(), near.end(), farther);
  internal::NearCandidates candidates;
  for (; !near.empty() && near.front().first <= limit(); near.pop_back()) {
    const internal::Brick* brick = near.front().second;
    std::pop_heap(near.begin(), near.end(), farther);
    const internal::KeyRange cells =
        internal::within_brick(internal::cells_near(level, shells.region_within(limit())), brick->geometry.key);
    candidates.collect(*brick, cells, point, shells.above(), internal::key_limit(limit()), work);
    if (!candidates.visit(limit, work, visit)) return false;
  }
  return true;
}

// Begins with the bounds of the values in the bricks that extend farthest. Then, for each side, visits the values that
// may extend beyond the bounds, and moves the side. If there are many, begins again with the moved side, beyond which
// there are far fewer. If the side has hardly moved, many values lie at the side itself, or are long in another
// direction, which the culling does not know; if there are too many to visit them all, visits all values of the
// snapshot once.
template <class BoundsOf>
Aabbd GridSnapshot::bounds(const BoundsOf& bounds_of, Work& work) const {
  // Maximum visits of a pass over the values beyond a side: of most passes, and of one that could not move the side.
  constexpr size_t kFewVisits = 4096, kManyVisits = size_t{1} << 17;
  Aabbd bounds;
  if (size_ == 0) return bounds;
  std::array<const internal::Brick*, 6> extreme{};
  const Aabbd outer = outer_bounds(extreme);
  const auto visit = [&](const GridRef& value) {
    bounds = merge(bounds, bounds_of(value));
    return true;
  };
  for (auto brick = extreme.begin(); brick != extreme.end(); ++brick)
    if (std::find(extreme.begin(), brick, *brick) == brick) internal::for_each_value(**brick, visit);
  const double margin = 0x1p-16 * magnitude(outer);
  size_t all_visits = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool is_high : {false, true}) {
      double& side = (is_high ? bounds.max : bounds.min)[axis];
      const double outermost = (is_high ? outer.max : outer.min)[axis];
      size_t limit = kFewVisits;
      while (is_high ? side < outermost : side > outermost) {
        const double before = side;
        Aabbd beyond = outer;
        (is_high ? beyond.min : beyond.max)[axis] = side;
        size_t visits = 0;
        visit_region(beyond, work, [&](const GridRef& value) { return visit(value) && ++visits < limit; });
        if (visits < limit) break;
        all_visits += visits;
        const bool has_moved = std::abs(side - before) > margin;
        if ((!has_moved && limit == kManyVisits) || all_visits > size_) {
          for_each(visit);
          return bounds;
        }
        limit = has_moved ? kFewVisits : kManyVisits;
      }
    }
  }
  return bounds;
}

template <class Visit>
bool GridSnapshot::for_each(const Visit& visit) const {
  for (const internal::GridLevel& level : levels_) {
    const bool keep_going =
        level.table->for_each([&](uint32_t index) { return internal::for_each_value(*bricks_[index], visit); });
    if (!keep_going) return false;
  }
  return true;
}

template <class Visit>
bool GridSnapshot::for_each_from(GridCursor& cursor, const Visit& visit) const {
  for (; cursor.brick < bricks_.size(); cursor = {cursor.brick + 1, 0}) {
    const internal::Brick* const brick = bricks_[cursor.brick].get();
    if (brick == nullptr) continue;
    LOCUS_DCHECK_LE(cursor.values, size_t{brick->size()});
    size_t index = 0;
    const bool keep_going = internal::for_each_value(*brick, [&](const GridRef& value) {
      if (index++ < cursor.values) return true;
      ++cursor.values;
      return visit(value);
    });
    if (!keep_going) return false;
  }
  return true;
}

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_HASH_GRID_GRID_SNAPSHOT_H_
