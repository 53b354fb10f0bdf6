#include "core/query/kinds/pair_query.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/geometry/shape_distance.h"
#include "core/index/hash_grid/kernels/grid_dispatch.h"
#include "core/query/kinds/hit_collector.h"
#include "core/query/kinds/object_parts.h"

namespace locus {
namespace {

// Second object of a row, and its distance from the first object.
struct Partner {
  Id other;
  float t;
};

// Return whether `a` comes before `b` in the order of the rows of one object: lower_other() if PairColumns::count is 0,
// otherwise nearer_partner().
bool lower_other(const Partner& a, const Partner& b) { return a.other < b.other; }
bool nearer_partner(const Partner& a, const Partner& b) { return std::tie(a.t, a.other) < std::tie(b.t, b.other); }

// Collector of the first rows in order. The rows of one object are offered in one call, as a run, so that only runs are
// sorted. Invariant: between calls the collector has at most 2 * max_rows_ rows, those of each run one after another.
class FirstPairs {
 public:
  FirstPairs(size_t max_rows, bool count_only) : max_rows_(max_rows), count_only_(count_only) {}

  // Offers all rows of one object, in order. No object may be offered twice.
  void offer(const GridRef& object, absl::Span<const Partner> partners) {
    count_ += partners.size();
    if (count_only_ || partners.empty()) return;
    runs_.push_back({object.entry().id, object, partners_.size(), partners.size()});
    partners_.insert(partners_.end(), partners.begin(), partners.end());
    if (partners_.size() > 2 * max_rows_) keep_first();
  }
  // Returns whether rows of an object with this id can still be among the first rows.
  bool has_room_for(Id id) const { return count_only_ || id <= last_id_; }
  // Returns the first rows in order. `moment` is the time at which the rows were found.
  PairAnswer finish(const SceneAtTime& moment) {
    if (partners_.size() > max_rows_) keep_first();
    PairAnswer answer;
    answer.count = count_;
    answer.truncated = truncated_;
    answer.rows.reserve(partners_.size());
    const std::vector<Key> keys = sorted_keys();
    for (size_t i = 0; i < keys.size(); ++i) {
      // The runs are read in random order: load the following ones into the cache.
      if (i + 2 * kAhead < keys.size()) __builtin_prefetch(&runs_[keys[i + 2 * kAhead].run]);
      if (i + kAhead < keys.size()) __builtin_prefetch(&partners_[runs_[keys[i + kAhead].run].begin]);
      const Key& key = keys[i];
      const Run& run = runs_[key.run];
      // Uses the id of the key, because the object's entry is usually not in the cache.
      for (const Partner& partner : absl::MakeConstSpan(partners_).subspan(run.begin, run.count))
        answer.rows.push_back({{partner.t, key.id, kNoTriangle, run.object, nullptr, &moment}, partner.other});
    }
    return answer;
  }

 private:
  // Number of runs between a prefetch and the use of the memory.
  static constexpr size_t kAhead = 8;

  struct Run {
    Id id;
    GridRef object;
    size_t begin, count;
  };
  // Id of a run's object, and the run's index.
  struct Key {
    Id id;
    uint32_t run;
  };

  // Returns the keys of all runs, sorted by id.
  std::vector<Key> sorted_keys() const {
    std::vector<Key> keys(runs_.size());
    for (uint32_t i = 0; i < keys.size(); ++i) keys[i] = {runs_[i].id, i};
    std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) { return a.id < b.id; });
    return keys;
  }
  // Sorts the runs and drops all rows after the first max_rows_ rows. Precondition: there are more rows than that.
  void keep_first() {
    std::vector<Partner> kept;
    kept.reserve(max_rows_);
    std::vector<Run> runs;
    for (const Key& key : sorted_keys()) {
      if (kept.size() == max_rows_) break;
      Run run = runs_[key.run];
      const auto from = partners_.begin() + static_cast<std::ptrdiff_t>(run.begin);
      run.begin = kept.size();
      run.count = std::min(run.count, max_rows_ - kept.size());
      kept.insert(kept.end(), from, from + static_cast<std::ptrdiff_t>(run.count));
      runs.push_back(run);
    }
    truncated_ = true;
    last_id_ = runs.back().id;
    runs_ = std::move(runs);
    partners_ = std::move(kept);
  }

  const size_t max_rows_;
  const bool count_only_;
  Id last_id_ = std::numeric_limits<Id>::max();
  std::vector<Run> runs_;
  std::vector<Partner> partners_;
  uint64_t count_ = 0;
  bool truncated_ = false;
};

// State that all searches of one block have in common.
struct PairSearch {
  QueryTask& task;
  const SceneAtTime& moment;
  const Filter filter;
  const Layers first_mask, second_mask;
  const float max_distance;
  const bool conservative;
  const bool by_balls;  // two balls are compared by their stored positions and extents
  const Id after_id, after_other;
  const bool is_directed;  // PairColumns::count is not 0: only the first object of a row needs first_mask

  bool may_be_first(const GridEntry& entry) const { return (entry.layers & first_mask) != 0; }
  bool may_be_second(const GridEntry& entry) const { return (entry.layers & second_mask) != 0; }
  static bool are_apart(const GridEntry& a, const GridEntry& b) {
    return a.id != b.id && (a.group == 0 || a.group != b.group);
  }
  // Returns whether (a, b) may be a row if PairColumns::count is 0: groups and masks allow the pair, `a` has the lower
  // id, and the row comes after (after_id, after_other). Does not apply the filter.
  bool may_be_row(const GridEntry& a, const GridEntry& b) const {
    if (b.id <= a.id && !(planted(PlantedBug::kPairBothSides) && b.id != a.id)) return false;
    if (a.id == after_id && b.id <= after_other) return false;
    return are_apart(a, b) && ((may_be_first(a) && may_be_second(b)) || (may_be_first(b) && may_be_second(a)));
  }
  // Returns a box that overlaps the bounds of every object within max_distance of an object with this shape.
  Aabbd reach_of(const GridRef& object, const Shape& shape) const {
    const Aabbd own = bounds_of(object, shape);
    const double reach = raised(max_distance);
    return grown(own, reach + 0x1p-40 * (magnitude(own) + reach));
  }
  // Returns the rounded distance between two objects. The object with the lower id is passed first, so that both orders
  // of the arguments return the same distance.
  float distance(Id a_id, const Shape& a, Id b_id, const Shape& b) const {
    if (conservative) return rounded_distance(distance_between(bounds_of(a), bounds_of(b)));
    return rounded_distance(a_id < b_id ? distance_between(a, b) : distance_between(b, a));
  }
  // Returns the rounded distance between two objects with these shapes at the time of the query. For compounds, returns
  // the least distance between parts that may form a pair, or NaN if there are none or it is more than `farthest`.
  float distance(const GridRef& a, const Shape& a_shape, const GridRef& b, const Shape& b_shape, float farthest) const {
    if (!has_parts(a) && !has_parts(b)) return distance(a.entry().id, a_shape, b.entry().id, b_shape);
    return distance_of_parts(a, a_shape, b, b_shape, farthest);
  }

 private:
  // Object without parts, or one part of a compound.
  struct Solid {
    Shape shape;
    Aabbd bounds;  // contains the bounds of the shape
    Layers layers;
  };
  using Solids = absl::InlinedVector<Solid, 1>;

  // Returns the solids of an object that the filter accepts.
  Solids solids_of(const GridRef& object, const Shape& shape) const {
    if (!has_parts(object)) return {{shape, bounds_of(shape), object.entry().layers}};
    Solids solids;
    const PlacedCompound placed(*compound_of(object), shape.position, shape.rotation);
    placed.for_each(object.entry().layers & filter.layers(), [&](const PlacedCompound::PlacedPart& part) {
      solids.push_back({part.shape(), part.loose_bounds(), object.entry().layers & part.part().layers});
      return true;
    });
    return solids;
  }
  // Returns whether two solids may form a pair, by the masks for first and second objects.
  bool may_pair(Layers a, Layers b) const {
    if ((a & first_mask) != 0 && (b & second_mask) != 0) return true;
    return !is_directed && (b & first_mask) != 0 && (a & second_mask) != 0;
  }
  float distance_of_parts(const GridRef& a, const Shape& a_shape, const GridRef& b, const Shape& b_shape,
                          float farthest) const {
    const Solids of_a = solids_of(a, a_shape), of_b = solids_of(b, b_shape);
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    float least = kInfinity;
    for (const Solid& one : of_a) {
      for (const Solid& other : of_b) {
        if (!may_pair(one.layers, other.layers)) continue;
        // Rounding may make the distance of two shapes less than that of their bounds, but not of their loose bounds.
        if (distance_between(one.bounds, other.bounds) > raised(std::min(least, farthest))) continue;
        ++task.work().tests;
        if (!task.count_test()) return kNone;
        least = std::min(least, distance(a.entry().id, one.shape, b.entry().id, other.shape));
      }
    }
    return least == kInfinity ? kNone : least;
  }
};

// Visitor that finds the objects within max_distance of one object. Used only with brute force, so it visits all
// objects.
class Partners {
 public:
  Partners(const PairSearch& search, const GridRef& object, std::vector<Partner>& rows)
      : search_(search), object_(object), shape_(search.moment.shape(object)), rows_(rows) {}

  Aabbd bounds() const { return search_.reach_of(object_, shape_); }
  GridRegion region() const { return search_.moment.region(bounds(), std::nullopt); }
  bool visit(const GridRef& other) {
    if (!search_.task.count_test()) return false;
    const GridEntry &a = object_.entry(), &b = other.entry();
    if (!search_.may_be_row(a, b) || !search_.filter.accepts(b)) return true;
    const float distance = search_.distance(object_, shape_, other, search_.moment.shape(other), search_.max_distance);
    if (distance <= search_.max_distance) rows_.push_back({b.id, distance});
    return true;
  }

 private:
  const PairSearch& search_;
  const GridRef object_;
  const Shape shape_;
  std::vector<Partner>& rows_;
};

// Search for the pairs of a group of neighbouring objects. Visits the objects near the group once, collects them as
// candidates in float columns, and culls the candidates by a kernel for each object of the group. Call add() for each
// object, then search().
class PairGroup {
 public:
  explicit PairGroup(const PairSearch& search) : search_(search), kernels_(active_grid_kernels()) {}

  bool empty() const { return size_ == 0; }
  // Adds an object unless the group is full, the object is too far from the group, or the object belongs to another
  // brick than the group. Returns whether the object was added.
  bool add(const GridRef& object) {
    if (size_ == kMembers || (!empty() && members_.front().object.brick() != object.brick())) return false;
    const Shape shape = search_.moment.shape(object);
    const Aabbd reach = search_.reach_of(object, shape);
    const Aabbd bounds = empty() ? reach : merge(bounds_, reach);
    // The search visits all objects in `bounds`, so a group of objects far apart would visit too many objects.
    if (!empty() && volume(bounds) > kMaxWaste * (volumes_ + volume(reach))) return false;
    bounds_ = bounds;
    volumes_ = empty() ? volume(reach) : volumes_ + volume(reach);
    Member& member = members_[size_++];
    member.object = object, member.shape = shape;
    return true;
  }
  // Offers the rows of all objects of the group, then empties the group.
  void search(FirstPairs& rows) {
    if (empty()) return;
    center_ = (bounds_.min + bounds_.max) * 0.5;
    for (size_t i = 0; i < size_; ++i) balls_[i] = ball_of(members_[i]);
    search_.task.visit_objects_in_region(search_.moment, *this);
    test_candidates();
    for (Member& member : absl::MakeSpan(members_.data(), size_)) {
      std::sort(member.rows.begin(), member.rows.end(), lower_other);
      rows.offer(member.object, member.rows);
      member.rows.clear();
    }
    size_ = 0;
  }

  const Aabbd& bounds() const { return bounds_; }
  GridRegion region() const { return search_.moment.region(bounds_, std::nullopt); }
  bool visit(const GridRef& object) {
    if (!search_.filter.accepts(object.entry())) return search_.task.count_test();
    const Vec3d position = search_.moment.between() ? search_.moment.shape(object).position : object.entry().position;
    const Vec3f local = to_float(position - center_);
    x_[count_] = local.x, y_[count_] = local.y, z_[count_] = local.z;
    extent_[count_] = static_cast<float>(extent_of(object) * (1 + kCullGrowth));
    candidates_[count_++] = object;
    return count_ < kCandidates || test_candidates();
  }

 private:
  static constexpr size_t kMembers = 32;
  static constexpr uint32_t kCandidates = GridRows::kMaxValues;
  static constexpr double kMaxWaste = 4;
  // Rounding in the columns, in the balls and in the kernel changes a distance by less than 2^-20 of the sum of the
  // extents and of the coordinates relative to center_.
  static constexpr double kCullGrowth = 0x1p-18;

  struct Member {
    GridRef object;
    Shape shape;
    std::vector<Partner> rows;  // empty between two searches; its memory is kept
  };

  static double volume(const Aabbd& box) {
    const Vec3d size = box.max - box.min;
    return size.x * size.y * size.z;
  }
  // Returns an upper bound, up to rounding, of the distance from the object's position to any point of its solid or,
  // with CONSERVATIVE, to any point of its bounds.
  double extent_of(const GridRef& object) const {
    return object.reach() * (search_.conservative ? double{kDiagonal} : 1.0);
  }
  // Returns the ball around the position of `member` that the kernel intersects with the balls of the candidates. The
  // kernel culls the candidates whose balls do not intersect the returned ball. The returned ball is so large that no
  // candidate within max_distance of the member is culled.
  GridBall ball_of(const Member& member) const {
    const Vec3d center = member.shape.position - center_;
    const double extent = planted(PlantedBug::kPairCullExtent) ? 0 : extent_of(member.object);
    const double reach = raised(search_.max_distance) + extent;
    const double rounding =
        kCullGrowth * (max_component(abs(center)) + reach) + internal::kBoundsGrowth * magnitude(bounds_) + 0x1p-60;
    const double radius = (reach + rounding) * (1 + kCullGrowth);
    const Vec3f local = to_float(center);
    return {{local.x, local.y, local.z},
            static_cast<float>(std::min(radius, double{std::numeric_limits<float>::max()}))};
  }
  // Tests the collected candidates against each member. Returns false if the query must end.
  bool test_candidates() {
    const GridRows all = {x_, y_, z_, extent_, nullptr, 1, {0}, {count_}};
    for (size_t i = 0; i < size_; ++i) {
      uint32_t slots[GridRows::kMaxValues + internal::GridBlock::kLanes];
      const uint32_t kept = kernels_.cull_ball(all, balls_[i], slots);
      const uint32_t vectors = count_ / internal::GridBlock::kLanes + 1;
      search_.task.work().cells += vectors;
      if (!search_.task.count_tests(vectors)) break;
      for (uint32_t k = 0; k < kept; ++k) test(members_[i], candidates_[slots[k]]);
    }
    count_ = 0;
    return !search_.task.ended();
  }
  void test(Member& member, const GridRef& other) {
    const GridEntry &a = member.object.entry(), &b = other.entry();
    if (!search_.may_be_row(a, b)) return;
    ++search_.task.work().tests;
    if (!search_.task.count_test()) return;
    const float distance = distance_to(member, other);
    if (distance <= search_.max_distance) member.rows.push_back({b.id, distance});
  }
  // Returns the rounded distance. Precondition: the member has the lower id.
  float distance_to(const Member& member, const GridRef& other) const {
    const GridEntry &a = member.object.entry(), &b = other.entry();
    if (search_.by_balls && a.kind == ShapeKind::kBall && b.kind == ShapeKind::kBall)
      return rounded_distance(distance_between(Balld{a.position, member.object.reach()}, {b.position, other.reach()}));
    return search_.distance(member.object, member.shape, other, search_.moment.shape(other), search_.max_distance);
  }

  const PairSearch& search_;
  const GridKernels& kernels_;
  std::array<Member, kMembers> members_;
  size_t size_ = 0;     // number of members
  Aabbd bounds_;        // union of reach_of() of all members
  double volumes_ = 0;  // sum of the volumes of reach_of() of all members
  Vec3d center_;        // origin of the columns
  std::array<GridBall, kMembers> balls_;
  // Columns of the candidates, padded to whole vectors.
  float x_[kCandidates + internal::GridBlock::kLanes] = {}, y_[kCandidates + internal::GridBlock::kLanes] = {},
                         z_[kCandidates + internal::GridBlock::kLanes] = {},
                         extent_[kCandidates + internal::GridBlock::kLanes] = {};
  std::array<GridRef, kCandidates> candidates_;
  uint32_t count_ = 0;
};

// Visitor of the objects near one object. Retains the nearest of them.
class NearestPartners {
 public:
  NearestPartners(const PairSearch& search, const GridRef& object, uint32_t count)
      : search_(search),
        object_(object),
        shape_(search.moment.shape(object)),
        extent_(extent_of(shape_, bounds_of(object, shape_), object, search.conservative)),
        count_(count),
        farthest_(search.max_distance) {}

  Vec3d position() const { return shape_.position; }
  // Returns the limit of squared distances from the object's position to the bounds of other objects.
  double limit() const {
    const double reach = raised(farthest_) + extent_;
    return squared_limit(reach * (1 + 0x1p-40));
  }
  bool visit(const GridRef& other) {
    if (!search_.task.count_test()) return false;
    const GridEntry &a = object_.entry(), &b = other.entry();
    if (!PairSearch::are_apart(a, b) || !search_.filter.accepts(b) || !search_.may_be_second(b)) return true;
    const float distance = search_.distance(object_, shape_, other, search_.moment.shape(other), farthest_);
    if (!(distance <= farthest_)) return true;
    rows_.push_back({b.id, distance});
    std::push_heap(rows_.begin(), rows_.end(), nearer_partner);
    if (rows_.size() > count_) {
      std::pop_heap(rows_.begin(), rows_.end(), nearer_partner);
      rows_.pop_back();
    }
    if (rows_.size() == count_) farthest_ = rows_.front().t;
    return true;
  }
  // Returns the rows in order; call it once.
  std::vector<Partner> finish() {
    std::sort_heap(rows_.begin(), rows_.end(), nearer_partner);
    return std::move(rows_);
  }

 private:
  // Returns an upper bound of the distance from the object's position to any point of its solid or, with CONSERVATIVE,
  // to any point of its bounds. The corners of the bounds may be farther away than the solid.
  static double extent_of(const Shape& shape, const Aabbd& bounds, const GridRef& object, bool conservative) {
    if (!conservative) return object.reach() * (1 + 0x1p-40);
    const Vec3d corner = max(abs(bounds.min - shape.position), abs(bounds.max - shape.position));
    return std::sqrt(squared_length(corner)) * (1 + 0x1p-40);
  }

  const PairSearch& search_;
  const GridRef object_;
  const Shape shape_;
  const double extent_;
  const size_t count_;
  float farthest_;
  std::vector<Partner> rows_;  // a heap whose front is the last row
};

// Returns the rows after the row with `after_other`, or all rows if there is no such row.
absl::Span<const Partner> behind(absl::Span<const Partner> rows, Id after_other) {
  const auto at = std::find_if(rows.begin(), rows.end(), [&](const Partner& row) { return row.other == after_other; });
  return at == rows.end() ? rows : rows.subspan(static_cast<size_t>(at - rows.begin()) + 1);
}

// Searches the partners of one object: all objects within max_distance if `count` is 0, otherwise the `count` nearest
// of them.
void search_object(const PairSearch& search, const GridRef& object, uint32_t count, FirstPairs& rows) {
  if (count == 0) {
    std::vector<Partner> found;
    Partners visitor(search, object, found);
    search.task.visit_objects_in_region(search.moment, visitor);
    std::sort(found.begin(), found.end(), lower_other);
    rows.offer(object, found);
  } else if (search.may_be_first(object.entry())) {
    NearestPartners visitor(search, object, count);
    search.task.visit_objects_near(search.moment, visitor.position(), visitor);
    const std::vector<Partner> found = visitor.finish();
    rows.offer(object, behind(found, object.entry().id == search.after_id ? search.after_other : kNoId));
  }
}

}  // namespace

PairAnswer run_pairs(QueryTask& task, const SceneAtTime& moment, const QueryBlock& block, const PairColumns& pairs) {
  if (block.source == Source::kStatic) return {};
  const auto mask = [](Layers layers) { return layers == 0 ? kAllLayers : layers; };
  const PairSearch search{task,
                          moment,
                          Filter(block, 0),
                          mask(pairs.first_mask),
                          mask(pairs.second_mask),
                          pairs.max_distance,
                          block.precision == Precision::kConservative,
                          block.precision != Precision::kConservative && !moment.between(),
                          block.after_id,
                          pairs.after_other,
                          pairs.count != 0};
  FirstPairs rows(block.max_results == 0 ? limits::kDefaultMaxResults : block.max_results, block.count_only);
  PairGroup group(search);
  const bool by_groups = pairs.count == 0 && task.uses_kernels();
  moment.objects().grid().for_each([&](const GridRef& object) {
    const GridEntry& entry = object.entry();
    ++task.work().tests;
    if (!task.count_test()) return false;
    // The object with the id after_id may have further rows: rows with partners after after_other.
    const bool is_behind = entry.id > block.after_id || (entry.id == block.after_id && pairs.after_other != 0);
    if (!is_behind || !rows.has_room_for(entry.id) || !search.filter.accepts(entry)) return true;
    if (!by_groups) {
      search_object(search, object, pairs.count, rows);
    } else if (!group.add(object)) {
      group.search(rows);
      group.add(object);
    }
    return !task.ended();
  });
  if (!task.ended()) group.search(rows);
  PairAnswer answer = rows.finish(moment);
  answer.truncated |= task.ended();
  return answer;
}

}  // namespace locus
