// Nearest-value search of the hash grid: visits shells of growing radius around a point. The values of a shell are
// collected by their distance in float and visited from near to far. So the search visits few values besides the
// nearest ones, even if many values surround the point. Used by GridSnapshot; one object per query and thread.
//
// The key of a value is the squared distance of its bounds from the point, computed in float. A key never exceeds the
// exact squared distance, and a value has the same key for every shell. A shell is a range of keys (above, up_to], so
// each value lies in exactly one shell.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_NEAREST_WALK_H_
#define LOCUS_CORE_INDEX_HASH_GRID_NEAREST_WALK_H_

#include <algorithm>
#include <bit>
#include <limits>

#include "absl/container/inlined_vector.h"
#include "core/index/hash_grid/brick_scan.h"

namespace locus::internal {

// Returns an upper bound of the keys of all values whose squared distance is at most `limit`.
float key_limit(double limit);

// Returns the estimated number of values per cell near `point`, a point in the brick; 0 if the brick has too few values
// for an estimate.
double values_per_cell(const Brick& brick, const Vec3d& point);
// Returns the mean number of values per cell of a level with `values` values.
double values_per_cell(const LevelGeometry& level, size_t values);

// Sequence of shells around a point on one level.
class NearestShells {
 public:
  // `per_cell` is the estimated number of values per cell near the point; the estimate affects only cost. Borrows
  // `level`.
  NearestShells(const Vec3d& point, const LevelGeometry& level, double per_cell);
  NearestShells(const Vec3d& point, const LevelGeometry&& level, double per_cell) = delete;

  // Advances to the next shell. Returns false, without advancing, if the shells so far contain all values whose squared
  // distance is at most `limit`.
  bool next(double limit);
  float above() const { return above_; }
  float up_to() const { return up_to_; }
  // Returns a box that overlaps the bounds of every value of the present shell.
  const Aabbd& region() const { return region_; }
  // Returns a box that overlaps the bounds of every value whose squared distance is at most `limit`.
  Aabbd region_within(double limit) const;

 private:
  const Vec3d point_;
  const LevelGeometry& level_;
  const double epsilon_;    // rounding allowance of the sides of a region
  double bounds_distance_;  // distance from the point to the bounds of the level
  double shell_width_;      // radius of the present shell minus bounds_distance_
  float above_ = -1;
  float up_to_ = -1;
  Aabbd region_;
};

// Candidates of one shell: values that are collected from several bricks and then visited from near to far.
class NearCandidates {
 public:
  // Adds the values whose key is in (above, up_to]. Searches the cells `cells` (relative to the brick) of the brick's
  // sorted block, and the brick's whole log.
  void collect(const Brick& brick, const KeyRange& cells, const Vec3d& point, float above, float up_to, Work& work);

  // Calls visit(GridRef) for each candidate within the squared distance limit(), the nearest first, until visit()
  // returns false; limit() may decrease during the visit. Returns false if visit() returned false. Removes all
  // candidates.
  template <class Limit, class Visit>
  bool visit(const Limit& limit, Work& work, const Visit& visit);

 private:
  struct Candidate {
    float key;
    uint32_t slot;
    uint32_t source;
  };
  struct Source {
    const GridBlock* block;
    uint32_t brick;
  };
  static constexpr int32_t kIndexMask = kMaxSorted - 1;

  GridRef value(const Candidate& candidate) const {
    const Source& source = sources_[candidate.source];
    return {*source.block, candidate.slot, source.brick};
  }
  void collect_rows(const GridBlock& block, uint32_t brick, const GridRows& rows, const GridNear& near);
  void collect_recent(const Brick& brick, const GridNear& near, Work& work);
  // Adds `count` candidates with the given slots and keys; sources_.back() is their block.
  void add(const uint32_t* slots, const float* keys, uint32_t count);
  // Sorts the candidates by key. May lower each key by up to 63 units in the last place; the keys stay sorted.
  void sort();

  absl::InlinedVector<Candidate, kMaxSorted> candidates_;
  absl::InlinedVector<Source, 8> sources_;
};

template <class Limit, class Visit>
bool NearCandidates::visit(const Limit& limit, Work& work, const Visit& visit) {
  sort();
  bool keep_going = true;
  for (const Candidate& candidate : candidates_) {
    if (candidate.key > key_limit(limit())) break;
    ++work.tests;
    keep_going = visit(value(candidate));
    if (!keep_going) break;
  }
  candidates_.clear();
  sources_.clear();
  return keep_going;
}

}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_NEAREST_WALK_H_
