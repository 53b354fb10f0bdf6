// How the hash grid finds what is nearest to a point: shells around it, each a little wider than the one before, whose
// values are collected by their distance in float and visited from near to far. So few are visited that are not among
// the nearest, however many those are. For GridSnapshot; one object a query and thread.
//
// A value's key is the squared distance of its bounds, in float and never more than in double; the same however often
// it is asked. A shell is the keys above one number and up to another, so that each value lies in exactly one.
#ifndef LOCUS_CORE_INDEX_HASH_GRID_NEAREST_WALK_H_
#define LOCUS_CORE_INDEX_HASH_GRID_NEAREST_WALK_H_

#include <algorithm>
#include <bit>
#include <limits>

#include "absl/container/inlined_vector.h"
#include "core/index/hash_grid/brick_scan.h"

namespace locus::internal {

// No key of bounds within the squared distance `limit` is greater.
float key_limit(double limit);

// About how many values there are in a cell near `point`, which lies in the brick; 0 where there are too few to say.
double values_per_cell(const Brick& brick, const Vec3d& point);
// The same of `values` anywhere on the level.
double values_per_cell(const LevelExtent& level, size_t values);

// The shells around a point on one level.
class NearestShells {
 public:
  // `per_cell`: about how many values there are in a cell near the point; decides cost only. Borrows the level.
  NearestShells(const Vec3d& point, const LevelExtent& level, double per_cell);
  NearestShells(const Vec3d& point, const LevelExtent&& level, double per_cell) = delete;

  // Goes on to the next shell; false where nothing remains within `limit`.
  bool next(double limit);
  float above() const { return above_; }
  float upto() const { return upto_; }
  // Every value of this shell reaches into it.
  const Aabbd& region() const { return region_; }
  // Every value within the squared distance `limit` reaches into it.
  Aabbd region_within(double limit) const;

 private:
  const Vec3d point_;
  const LevelExtent& level_;
  const double slack_;  // of a region's sides
  double away_;         // the point, from the bounds of all
  double width_;        // of the ball around the point, beyond that
  float above_ = -1;
  float upto_ = -1;
  Aabbd region_;
};

// Values of some bricks, visited from near to far.
class NearCandidates {
 public:
  // Adds the values of `cells`, numbered within the brick, and those that came lately, whose key is in the shell.
  void collect(const Brick& brick, const KeyRange& cells, const Vec3d& point, float above, float upto, Work& work);

  // visit(GridRef) of each, the nearest first, up to limit(), which may fall meanwhile; false once visit() was. None
  // remains.
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
  static constexpr int32_t kNumberBits = kMaxSorted - 1;

  GridRef value(const Candidate& candidate) const {
    const Source& source = sources_[candidate.source];
    return {*source.block, candidate.slot, source.brick};
  }
  void collect_rows(const GridBlock& block, uint32_t brick, const GridRows& rows, const GridNear& near);
  void collect_recent(const Brick& brick, const GridNear& near, Work& work);
  // Candidates of the last source.
  void add(const uint32_t* slots, const float* keys, uint32_t count);
  // By their keys, which become a little smaller: none becomes greater than a later one's.
  void sort();

  absl::InlinedVector<Candidate, kMaxSorted> candidates_;
  absl::InlinedVector<Source, 8> sources_;
};

template <class Limit, class Visit>
bool NearCandidates::visit(const Limit& limit, Work& work, const Visit& visit) {
  sort();
  bool go_on = true;
  for (const Candidate& candidate : candidates_) {
    if (candidate.key > key_limit(limit())) break;
    ++work.tests;
    go_on = visit(value(candidate));
    if (!go_on) break;
  }
  candidates_.clear();
  sources_.clear();
  return go_on;
}

}  // namespace locus::internal

#endif  // LOCUS_CORE_INDEX_HASH_GRID_NEAREST_WALK_H_
