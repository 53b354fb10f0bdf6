// The hash grid at one moment: what readers hold. Immutable, copied in O(1), any thread. It only culls: every value
// that may be wanted is handed to the caller, once, and the caller decides by the value's own predicate in double.
//
// A value is filed by its position in one cell of the level whose cells are at least as wide as the value, so that a
// query looks half a cell around itself on each level and misses nothing, and no single large value makes all lookups
// wide. Levels are visited coarse to fine, so that a large near thing shortens a ray before the many small ones are
// asked. Source: Ericson, Real-Time Collision Detection, 2005, 7.2 (one cell a value); Schornbaum, Hierarchical Hash
// Grids for Coupled Particle Simulations, 2009.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_GRID_SNAPSHOT_H_
#define LOCUS_CORE_INDEX_HASH_GRID_GRID_SNAPSHOT_H_

#include <memory>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "core/base/persistent_array.h"
#include "core/index/hash_grid/brick_scan.h"
#include "core/index/hash_grid/brick_table.h"
#include "core/index/hash_grid/nearest_walk.h"

namespace locus {

struct GridStatistics {
  size_t values = 0;
  size_t levels = 0;
  size_t bricks = 0;
  size_t cells = 0;      // occupied
  double cell_size = 0;  // of the base level
  size_t bytes = 0;      // of bricks and values, shared with copies or not, and of the tables that find them
};

namespace internal {

inline constexpr size_t kBricksPerLeaf = 64;
using BrickArray = PersistentArray<BrickPtr, kBricksPerLeaf>;
// The number of the brick that each handle's value is in.
using BrickNumbers = PersistentArray<uint32_t, 1024>;

struct GridLevel {
  int exponent = 0;    // of the cell edge
  LevelExtent extent;  // covers every value; does not shrink until the level is empty
  size_t size = 0;     // values
  std::shared_ptr<const BrickTable> table;
};

// What of a level a region can reach.
KeyRange cells_near(const GridLevel& level, const Aabbd& region);
// The cells of `range` that lie in the brick, numbered within it.
KeyRange within_brick(const KeyRange& range, const GridKey& brick);

}  // namespace internal

// How far a walk through a snapshot has come; of no meaning to another snapshot.
struct GridCursor {
  size_t brick = 0;
  size_t values = 0;  // of that brick that are done with
};

class GridSnapshot {
 public:
  GridSnapshot() = default;
  GridSnapshot(std::vector<internal::GridLevel> levels, internal::BrickArray bricks,
               internal::BrickNumbers bricks_by_handle, double cell_size);

  size_t size() const { return size_; }
  // Of the base level.
  double cell_size() const { return cell_size_; }

  // visit(GridRef) for every value whose bounds overlap `region`, and for others near it; false ends the visit.
  template <class Visit>
  void visit_region(const Aabbd& region, Work& work, const Visit& visit) const;
  // The same for a ball with those bounds: visit(GridRef) for every value of which a part lies in the ball, and for
  // others near it. Fewer than by the bounds alone, but not all whose own bounds overlap them.
  template <class Visit>
  void visit_ball(const Balld& ball, const Aabbd& bounds, Work& work, const Visit& visit) const;
  // fn(brick, cells) for each brick, and its own cells, where such a visit looks; false, after some of them, if they
  // are more than `most`.
  template <class Fn>
  bool for_few_bricks(const Aabbd& region, size_t most, Work& work, const Fn& fn) const;

  // visit(GridRef) for every value whose own interval on the ray has near <= far, far >= 0 and near <= limit(), and for
  // others near the ray; roughly near to far on each level. limit() may fall meanwhile; false ends the visit. For
  // values that are elsewhere than filed, by up to `astray`, likewise.
  template <class Limit, class Visit>
  void visit_ray(const SlabRay<double>& ray, const Limit& limit, Work& work, const Visit& visit,
                 double displacement_bound = 0) const;

  // visit(GridRef) for every value whose bounds have a squared_distance() from `point` of at most limit(), and for
  // others near it; on each level about from near to far. limit() may fall meanwhile; false ends the visit. Cost: the
  // cells within the last value's distance, or a look at every brick where those are fewer.
  template <class Limit, class Visit>
  void visit_nearest(const Vec3d& point, const Limit& limit, Work& work, const Visit& visit) const;

  // visit(GridRef) for each value, until it returns false, which is then returned.
  template <class Visit>
  bool for_each(const Visit& visit) const;
  // The same for those from the cursor on, which it moves beyond each that is visited: so that a long walk can be made
  // in steps. O(visited values, and a look at those of the brick where it goes on).
  template <class Visit>
  bool for_each_from(GridCursor& cursor, const Visit& visit) const;

  // The value of a handle that is in use here. O(values in its brick).
  GridRef at(uint32_t handle) const;
  // The value of any handle that was ever in use in the grid; nothing where it is not in use here. O(values in a
  // brick).
  GridRef find(uint32_t handle) const;
  // The same for the handle of a value of another snapshot of the grid: quick where it lies about there here, too.
  GridRef find_like(const GridRef& value) const;

  // O(bricks).
  GridStatistics statistics() const;
  // Bytes of what `other`, another snapshot of the grid, does not share. O(bricks that differ).
  size_t unshared_bytes(const GridSnapshot& other) const;

 private:
  const internal::Brick* find_brick(const internal::GridLevel& level, const internal::GridKey& key) const;
  static GridRef find_in(const internal::Brick& brick, uint32_t handle);
  // fn(brick) for those bricks of the range that exist, until fn returns false, which is then returned.
  template <class Fn>
  bool for_each_brick(const internal::GridLevel& level, const internal::KeyRange& bricks, Work& work,
                      const Fn& fn) const;
  // cull_of(brick) says which values of the brick are visited: as RowScan's Cull.
  template <class CullOf, class Visit>
  void visit_cells(const Aabbd& region, Work& work, const CullOf& cull_of, const Visit& visit) const;
  template <class Limit, class Visit>
  bool march(const internal::GridLevel& level, const internal::SlabMarch& slabs, double margin,
             const SlabRay<double>& ray, const Limit& limit, Work& work, const Visit& visit) const;
  // About how many values share a cell there.
  double values_per_cell(const internal::GridLevel& level, const Vec3d& point) const;
  // For shells that would name more bricks than there are, from the present one on.
  template <class Limit, class Visit>
  bool visit_nearest_bricks(const internal::GridLevel& level, const internal::NearestShells& shells, const Vec3d& point,
                            const Limit& limit, Work& work, const Visit& visit) const;
  // For rays that would name more bricks than there are.
  template <class Limit, class Visit>
  bool visit_by_distance(const internal::GridLevel& level, double reach, double margin, const SlabRay<double>& ray,
                         const Limit& limit, Work& work, const Visit& visit) const;

  std::vector<internal::GridLevel> levels_;  // coarse to fine
  internal::BrickArray bricks_;
  internal::BrickNumbers bricks_by_handle_;
  size_t size_ = 0;
  double cell_size_ = 0;
};

inline const internal::Brick* GridSnapshot::find_brick(const internal::GridLevel& level,
                                                       const internal::GridKey& key) const {
  const uint32_t number =
      level.table->find(key, [&](uint32_t candidate) { return bricks_[candidate]->place.key == key; });
  return number == internal::BrickTable::kNone ? nullptr : bricks_[number].get();
}

template <class Fn>
bool GridSnapshot::for_each_brick(const internal::GridLevel& level, const internal::KeyRange& bricks, Work& work,
                                  const Fn& fn) const {
  if (bricks.empty()) return true;
  if (bricks.count() > static_cast<double>(level.table->size())) {
    work.cells += level.table->size();
    return level.table->for_each([&](uint32_t number) {
      const internal::Brick& brick = *bricks_[number];
      return !bricks.contains(brick.place.key) || fn(brick);
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
void GridSnapshot::visit_region(const Aabbd& region, Work& work, const Visit& visit) const {
  visit_cells(region, work, internal::BoxCull(region), visit);
}

template <class Visit>
void GridSnapshot::visit_ball(const Balld& ball, const Aabbd& bounds, Work& work, const Visit& visit) const {
  visit_cells(bounds, work, internal::BallCull(ball), visit);
}

template <class Fn>
bool GridSnapshot::for_few_bricks(const Aabbd& region, size_t most, Work& work, const Fn& fn) const {
  size_t left = most;
  for (const internal::GridLevel& level : levels_) {
    const internal::KeyRange cells = internal::cells_near(level, region);
    const internal::KeyRange bricks = internal::bricks_of(cells);
    if (bricks.empty()) continue;
    if (bricks.count() > static_cast<double>(left)) return false;
    for_each_brick(level, bricks, work, [&](const internal::Brick& brick) {
      fn(brick, internal::within_brick(cells, brick.place.key));
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
    const bool go_on = for_each_brick(level, internal::bricks_of(cells), work, [&](const internal::Brick& brick) {
      const auto cull = cull_of(brick);
      return internal::scan_cells(brick, internal::within_brick(cells, brick.place.key), work, cull, visit) &&
             internal::scan_recent(brick, work, cull, visit);
    });
    if (!go_on) return;
  }
}

template <class Limit, class Visit>
void GridSnapshot::visit_ray(const SlabRay<double>& ray, const Limit& limit, Work& work, const Visit& visit,
                             double displacement_bound) const {
  for (const internal::GridLevel& level : levels_) {
    internal::LevelExtent extent = level.extent;
    if (displacement_bound > 0) {
      extent.reach += displacement_bound;
      extent.bounds = grown(extent.bounds, displacement_bound);
    }
    const internal::SlabMarch slabs(ray, extent, limit());
    const double margin = displacement_bound + 2 * ray.margin(magnitude(extent.bounds));
    const bool go_on = slabs.bricks() > static_cast<double>(level.table->size())
                           ? visit_by_distance(level, extent.reach, margin, ray, limit, work, visit)
                           : march(level, slabs, margin, ray, limit, work, visit);
    if (!go_on) return;
  }
}

template <class Limit, class Visit>
bool GridSnapshot::march(const internal::GridLevel& level, const internal::SlabMarch& slabs, double margin,
                         const SlabRay<double>& ray, const Limit& limit, Work& work, const Visit& visit) const {
  constexpr int kLayers = 1 << internal::kBrickBits;
  const GridKernels& kernels = active_grid_kernels();
  struct Met {
    const internal::Brick* brick;
    internal::CullRay ray;
  };
  absl::InlinedVector<Met, 16> met;
  for (int64_t n = 0; n < slabs.slabs(); ++n) {
    const internal::SlabMarch::Slab slab = slabs.slab(n, limit());
    if (slab.near > limit()) return true;
    met.clear();
    for_each_brick(level, slab.bricks, work, [&](const internal::Brick& brick) {
      met.push_back({&brick, internal::CullRay(brick, ray, margin)});
      return true;
    });
    for (Met& one : met) {
      one.ray.end_at(limit());
      const auto cull = [&](const GridRows& rows, uint32_t* slots) {
        return kernels.cull_line(rows, one.ray.line(), slots);
      };
      if (!internal::scan_recent(*one.brick, work, cull, visit)) return false;
    }
    for (int number = 0; number < kLayers && !met.empty(); ++number) {
      const internal::SlabMarch::Layer layer = slabs.layer(n, number, limit());
      if (layer.near > limit()) return true;
      for (Met& one : met) {
        const internal::KeyRange cells = internal::within_brick(layer.cells, one.brick->place.key);
        if (cells.empty()) continue;
        one.ray.end_at(limit());
        const auto cull = [&](const GridRows& rows, uint32_t* slots) {
          return kernels.cull_line(rows, one.ray.line(), slots);
        };
        if (!internal::scan_cells(*one.brick, cells, work, cull, visit)) return false;
      }
    }
  }
  return true;
}

template <class Limit, class Visit>
bool GridSnapshot::visit_by_distance(const internal::GridLevel& level, double reach, double margin,
                                     const SlabRay<double>& ray, const Limit& limit, Work& work,
                                     const Visit& visit) const {
  struct Candidate {
    double near;
    const internal::Brick* brick;
  };
  const GridKernels& kernels = active_grid_kernels();
  absl::InlinedVector<Candidate, 32> candidates;
  level.table->for_each([&](uint32_t number) {
    ++work.cells;
    const internal::Brick& brick = *bricks_[number];
    const Vec3d half = Vec3d{1, 1, 1} * (brick.place.edge / 2 + reach);
    const Interval<double> part = ray.interval({brick.place.center - half, brick.place.center + half});
    if (part.near <= part.far && part.far >= 0 && part.near <= limit()) candidates.push_back({part.near, &brick});
    return true;
  });
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.near < b.near; });
  for (const Candidate& candidate : candidates) {
    if (candidate.near > limit()) break;
    internal::CullRay cull_ray(*candidate.brick, ray, margin);
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
  constexpr size_t kFewBricks = 1024;  // so many are looked at shell by shell, even if they are all there are
  internal::NearCandidates candidates;
  for (const internal::GridLevel& level : levels_) {
    internal::NearestShells shells(point, level.extent, values_per_cell(level, point));
    while (shells.next(limit())) {
      const internal::KeyRange cells = internal::cells_near(level, shells.region());
      const internal::KeyRange bricks = internal::bricks_of(cells);
      if (bricks.count() > static_cast<double>(std::max(level.table->size(), kFewBricks))) {
        if (!visit_nearest_bricks(level, shells, point, limit, work, visit)) return;
        break;
      }
      for_each_brick(level, bricks, work, [&](const internal::Brick& brick) {
        candidates.collect(brick, internal::within_brick(cells, brick.place.key), point, shells.above(), shells.upto(),
                           work);
        return true;
      });
      if (!candidates.visit(limit, work, visit)) return;
    }
  }
}

template <class Limit, class Visit>
bool GridSnapshot::visit_nearest_bricks(const internal::GridLevel& level, const internal::NearestShells& shells,
                                        const Vec3d& point, const Limit& limit, Work& work, const Visit& visit) const {
  absl::InlinedVector<std::pair<double, const internal::Brick*>, 32> near;
  level.table->for_each([&](uint32_t number) {
    ++work.cells;
    const internal::Brick& brick = *bricks_[number];
    const double away = squared_distance(point, internal::box_of_values(brick, level.extent.reach));
    if (away <= limit()) near.emplace_back(away, &brick);
    return true;
  });
  const auto farther = [](const auto& a, const auto& b) { return a.first > b.first; };
  std::make_heap(near.begin(), near.end(), farther);
  internal::NearCandidates candidates;
  for (; !near.empty() && near.front().first <= limit(); near.pop_back()) {
    const internal::Brick* brick = near.front().second;
    std::pop_heap(near.begin(), near.end(), farther);
    const internal::KeyRange cells =
        internal::within_brick(internal::cells_near(level, shells.region_within(limit())), brick->place.key);
    candidates.collect(*brick, cells, point, shells.above(), internal::key_limit(limit()), work);
    if (!candidates.visit(limit, work, visit)) return false;
  }
  return true;
}

template <class Visit>
bool GridSnapshot::for_each(const Visit& visit) const {
  for (const internal::GridLevel& level : levels_) {
    const bool go_on =
        level.table->for_each([&](uint32_t number) { return internal::for_each_value(*bricks_[number], visit); });
    if (!go_on) return false;
  }
  return true;
}

template <class Visit>
bool GridSnapshot::for_each_from(GridCursor& cursor, const Visit& visit) const {
  for (; cursor.brick < bricks_.size(); cursor = {cursor.brick + 1, 0}) {
    const internal::Brick* const brick = bricks_[cursor.brick].get();
    if (brick == nullptr) continue;
    size_t number = 0;
    const bool go_on = internal::for_each_value(*brick, [&](const GridRef& value) {
      if (number++ < cursor.values) return true;
      ++cursor.values;
      return visit(value);
    });
    if (!go_on) return false;
  }
  return true;
}

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_HASH_GRID_GRID_SNAPSHOT_H_
