// Density map of the hash grid: where in space values are dense enough for the cells of the base level. Where they are
// sparser, they are stored in wider cells, so that lone values do not each occupy a brick of their own. The map affects
// only cost, never the result of a query; queries do not read it.
//
// The map is an octree whose nodes are found by hash: the nodes are the bricks of the density levels, whose exponents
// are base, base + 2, base + 4, ... up to the one whose bricks are as wide as all values together. So a cell of one
// density level is a brick of the next finer one, and a node has 64 children. A node is dense if its values, those of
// all levels together, would fill the bricks of its children: if the children that have values have at least
// `min_brick_values` on average, or one has kCrowd times as many, or if a child is dense. Half of these numbers suffice
// for a node that is already dense, so that values do not move back and forth. A value is stored on the finest density
// level whose next coarser node, at the position of the value, is dense. Source of the structure: Gargantini, An
// Effective Way to Represent Quadtrees, 1982 (nodes in a table).
//
// Threads: as for a standard container. Invariant: the parent of a dense node is dense.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_DENSITY_MAP_H_
#define LOCUS_CORE_INDEX_HASH_GRID_DENSITY_MAP_H_

#include <algorithm>
#include <cstddef>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "core/index/hash_grid/brick.h"

namespace locus::internal {

// The map of a grid has sparse regions only if this share of the finest nodes is sparse. Otherwise, for example if only
// nodes at the edge of a uniform world are sparse, wider cells would save less than a further level costs. The share is
// half as large for a grid that already has sparse regions. Cells whose values are all stored in wider ones are sparse.
inline constexpr double kMinSparseShare = 1.0 / 4;

inline constexpr double kCrowd = 8;

class DensityMap {
 public:
  // Makes a map by which every position is dense.
  explicit DensityMap(int base_exponent) : base_(base_exponent), top_(base_exponent) {}

  int base_exponent() const { return base_; }
  // Returns the exponent of the density level for values at `position`. O(density levels up to the returned one); one
  // lookup where values are dense, none if there is no sparse region.
  int exponent_at(Vec3d position) const;
  // Returns true if the brick with the key `key` on the level `exponent` may contain values that the map `before`,
  // with the same base exponent, assigns to this level, and that this map assigns to another level.
  bool differs(const DensityMap& before, const GridKey& key, int exponent) const;

 private:
  friend class DensityCount;
  using Nodes = absl::flat_hash_set<GridKey, GridKeyHash>;

  bool has_sparse_regions() const { return top_ > base_; }
  // Returns whether a node is dense; `exponent` is one of a density level above the base level. Nodes above top_, which
  // are wider than all values together, count as dense.
  bool is_dense(const GridKey& key, int exponent) const;

  int base_;
  int top_;                   // exponent of the coarsest density level; equals base_ if there are no sparse regions
  std::vector<Nodes> dense_;  // dense nodes of the levels base_ + 2, base_ + 4, ..., top_
};

// Counts the values of each node, and makes a map of the counts.
class DensityCount {
 public:
  // `bounds` are the bounds of the positions of most values; `base_exponent` is that of the grid.
  DensityCount(int base_exponent, const Aabbd& bounds);

  // Adds the values of a brick on any level from the base level on. Values of a brick that is wider than the coarsest
  // node are ignored. O(cells of the brick).
  void add(const Brick& brick);
  // Adds `values` values at `position`.
  void add(Vec3d position, double values);
  // Returns the map of all values added; `before` is the present map of the grid, or null if it has another base
  // exponent. O(nodes).
  DensityMap map(double min_brick_values, const DensityMap* before);

 private:
  struct Node {
    double values = 0;
    double max_of_child = 0;  // largest number of values of one child
    uint64_t children = 0;    // one bit for each child that has values, numbered as by index_in_brick()
    uint64_t nodes = 0;       // those of them that are nodes; the values of the others are stored on this node's level
    bool has_dense_child = false;

    void add_child(const GridKey& key, double child_values);
    bool is_dense(double min_brick_values) const;
  };
  using Counts = absl::flat_hash_map<GridKey, Node, GridKeyHash>;

  int base_, top_;
  // Nodes of the levels base_, base_ + 2, ..., top_ with the values added; map() adds those of their children.
  std::vector<Counts> counts_;
};

}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_DENSITY_MAP_H_
