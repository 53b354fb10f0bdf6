// Verifier of spatial indexes: runs every kind of query on an index and on an oracle and compares the answers, pairs of
// t and id, bit for bit. Also checks the contract of an index: the index passes to the visitor, exactly once, every
// value whose ray interval or bounds satisfy the query's limit. Used by unit tests, random tests and tests of planted
// bugs.
#ifndef LOCUS_TESTS_SUPPORT_INDEX_JUDGE_H_
#define LOCUS_TESTS_SUPPORT_INDEX_JUDGE_H_

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "core/index/list/list_index.h"
#include "core/index/queries/nearest_values.h"
#include "tests/support/scene_sketch.h"

namespace locus::test {

template <Bounded V>
ListIndex<V> make_list(const std::vector<V>& values) {
  ListIndex<V> list;
  for (const V& value : values) list.insert(value);
  return list;
}

// Comparison of one index with an oracle. Each function returns the first difference, or an empty string.
template <SpatialIndex Index>
class IndexJudge {
 public:
  using Value = typename Index::Value;
  using Traits = typename Index::Traits;
  using S = typename Traits::Scalar;
  using Hits = std::vector<RayHit<Value, Traits>>;

  // Borrows both arguments, which must hold the same values.
  IndexJudge(const Index& index, const ListIndex<Value, Traits>& oracle) : index_(index), oracle_(oracle) {}

  std::string difference(const TestScene<Value>& scene) const {
    if (index_.size() != oracle_.size()) return "the sizes differ";
    for (size_t i = 0; i < scene.rays.size(); ++i) {
      if (std::string what = ray_difference(scene.rays[i], i); !what.empty()) return label(scene, "ray", i) + what;
    }
    for (size_t i = 0; i < scene.balls.size(); ++i) {
      if (std::string what = ball_difference(scene.balls[i]); !what.empty()) return label(scene, "ball", i) + what;
      // Move every second centre by less than the resolution of float.
      const Vec3d center = to_double(scene.balls[i].center) * (i % 2 == 0 ? 1 : 1 + 0x1p-25);
      if (std::string what = point_difference(center); !what.empty()) return label(scene, "centre of ball", i) + what;
    }
    for (size_t i = 0; i < scene.boxes.size(); ++i) {
      if (std::string what = box_difference(scene.boxes[i]); !what.empty()) return label(scene, "box", i) + what;
    }
    return "";
  }

  // Compares the first hit, any hit, all hits and the conservative results of a ray. The limits are infinity and, for
  // each of the two nearest hits, its t, the next greater value of type S, and half of its t. The contract of
  // visit_ray() is checked without a limit and with limits at which the ray enters the bounds of a value; `turn`
  // selects these values.
  std::string ray_difference(const typename Traits::RayQuery& ray, size_t turn) const {
    constexpr S kInfinity = std::numeric_limits<S>::infinity();
    Hits hits;
    all_rays(oracle_, ray, kInfinity, oracle_.size(), hits);
    std::vector<S> distances = {kInfinity};
    for (size_t i = 0; i < std::min<size_t>(hits.size(), 2); ++i) {
      const S t = hits[i].distance;
      distances.insert(distances.end(), {t, std::nextafter(t, kInfinity), t / 2});
    }
    for (const S distance : distances) {
      if (std::string what = difference_up_to(ray, distance); !what.empty()) return what;
    }
    return broken_ray_contract(ray, turn);
  }

  std::string ball_difference(const typename Traits::BallQuery& ball) const {
    const auto exact = [&](const auto& index, auto& result) { ball_overlap(index, ball, result); };
    const auto conservative = [&](const auto& index, auto& result) { conservative_ball(index, ball, result); };
    return overlap_difference(exact, conservative);
  }

  // Compares the nearest value and the 200 nearest values. The limits are infinity, the distance of one value, and the
  // next smaller double.
  std::string point_difference(const Vec3d& point) const {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    std::vector<ValueAt<Value, Traits>> all;
    nearest_values(oracle_, point, kInfinity, oracle_.size(), all);
    std::vector<double> distances = {kInfinity};
    if (const size_t i = all.size() / 3; i < all.size())
      distances.insert(distances.end(), {all[i].distance, std::nextafter(all[i].distance, 0.0)});
    for (const double distance : distances) {
      for (const size_t count : {size_t{1}, std::min<size_t>(oracle_.size(), 200)}) {
        std::vector<ValueAt<Value, Traits>> got, expected;
        nearest_values(index_, point, distance, count, got);
        nearest_values(oracle_, point, distance, count, expected);
        if (std::string what = nearest_difference(got, expected); !what.empty())
          return text("nearest ", count, " within ", distance, ": ", what);
      }
      if (std::string what = broken_point_contract(point, squared_limit(distance)); !what.empty()) return what;
    }
    return "";
  }

  std::string box_difference(const typename Traits::BoxQuery& box) const {
    const auto exact = [&](const auto& index, auto& result) { box_overlap(index, box, result); };
    const auto conservative = [&](const auto& index, auto& result) { conservative_box(index, box, result); };
    return overlap_difference(exact, conservative);
  }

 private:
  // Visitor that collects the ids of all visited values, with a fixed limit.
  template <class Limit>
  class Recorder {
   public:
    explicit Recorder(Limit limit) : limit_(limit) {}
    Limit limit() const { return limit_; }
    bool visit(const Value& value) {
      ids_.push_back(Traits::id(value));
      return true;
    }
    std::vector<uint64_t> sorted_ids() {
      std::sort(ids_.begin(), ids_.end());
      return ids_;
    }

   private:
    Limit limit_;
    std::vector<uint64_t> ids_;
  };

  static std::string label(const TestScene<Value>& scene, const char* kind, size_t number) {
    return scene.name + ", " + kind + " " + std::to_string(number) + ": ";
  }

  template <class... Parts>
  static std::string text(const Parts&... parts) {
    std::ostringstream stream;
    stream << std::hexfloat;
    (stream << ... << parts);
    return stream.str();
  }

  static std::vector<uint64_t> sorted_ids(const std::vector<Value>& values) {
    std::vector<uint64_t> ids;
    for (const Value& value : values) ids.push_back(Traits::id(value));
    std::sort(ids.begin(), ids.end());
    return ids;
  }

  static std::string list_difference(const std::vector<uint64_t>& got, const std::vector<uint64_t>& expected) {
    if (got == expected) return "";
    std::ostringstream stream;
    stream << "ids";
    for (const uint64_t id : got) stream << ' ' << id;
    stream << ", but the list says";
    for (const uint64_t id : expected) stream << ' ' << id;
    return stream.str();
  }

  static std::string hits_difference(const Hits& got, const Hits& expected) {
    if (got.size() != expected.size()) return text("all: ", got.size(), " hits, but the list says ", expected.size());
    for (size_t i = 0; i < got.size(); ++i) {
      const auto id = Traits::id(got[i].value), expected_id = Traits::id(expected[i].value);
      if (got[i].distance != expected[i].distance || id != expected_id)
        return text("all, hit ", i, ": t ", got[i].distance, " id ", id, ", but the list says t ", expected[i].distance,
                    " id ", expected_id);
    }
    return "";
  }

  std::string first_difference(const typename Traits::RayQuery& ray, S limit) const {
    Value value{}, expected{};
    S t = limit, expected_t = limit;
    const bool hit = first_ray(index_, ray, value, t);
    const bool expected_hit = first_ray(oracle_, ray, expected, expected_t);
    if (hit == expected_hit && t == expected_t && Traits::id(value) == Traits::id(expected)) return "";
    return text("first up to ", limit, ": hit ", hit, " t ", t, " id ", Traits::id(value), ", but the list says hit ",
                expected_hit, " t ", expected_t, " id ", Traits::id(expected));
  }

  std::string difference_up_to(const typename Traits::RayQuery& ray, S distance) const {
    if (std::string what = first_difference(ray, distance); !what.empty()) return what;
    if (any_ray(index_, ray, distance) != any_ray(oracle_, ray, distance)) return text("any up to ", distance);
    for (const size_t max_hits : {size_t{2}, oracle_.size()}) {
      Hits got, expected;
      all_rays(index_, ray, distance, max_hits, got);
      all_rays(oracle_, ray, distance, max_hits, expected);
      if (std::string what = hits_difference(got, expected); !what.empty()) return what;
    }
    std::vector<Value> got, expected;
    conservative_ray(index_, ray, distance, got);
    conservative_ray(oracle_, ray, distance, expected);
    return list_difference(sorted_ids(got), sorted_ids(expected));
  }

  // Returns the first violation of the contract of visit_ray(); empty if there is none. The index must pass every value
  // whose interval starts at or before the limit, pass no value twice, and count one test for each value that it
  // passes.
  std::string broken_ray_contract(const typename Traits::RayQuery& ray, size_t turn) const {
    const auto values = oracle_.values();
    for (size_t i = 0; i < std::min<size_t>(values.size(), 4); ++i) {
      const Interval<S> chosen = ray.slabs().interval(Traits::bounds(values[(turn * 4 + i) % values.size()]));
      const S limit = i == 0 ? std::numeric_limits<S>::infinity() : chosen.near;
      Recorder<S> recorder(limit);
      Work work;
      index_.visit_ray(ray.slabs(), recorder, work);
      const std::vector<uint64_t> ids = recorder.sorted_ids();
      if (std::adjacent_find(ids.begin(), ids.end()) != ids.end()) return "a value was handed over twice";
      if (work.tests != ids.size()) return text("counted ", work.tests, " tests for ", ids.size(), " values");
      for (const Value& value : values) {
        const Interval<S> own = ray.slabs().interval(Traits::bounds(value));
        const bool wanted = own.near <= own.far && own.far >= 0 && own.near <= limit;
        if (wanted && !std::binary_search(ids.begin(), ids.end(), Traits::id(value)))
          return text("id ", Traits::id(value), " with near ", own.near, " was not handed over up to ", limit);
      }
    }
    return "";
  }

  static std::string nearest_difference(const std::vector<ValueAt<Value, Traits>>& got,
                                        const std::vector<ValueAt<Value, Traits>>& expected) {
    if (got.size() != expected.size()) return text(got.size(), " values, but the list says ", expected.size());
    for (size_t i = 0; i < got.size(); ++i) {
      const auto id = Traits::id(got[i].value), expected_id = Traits::id(expected[i].value);
      if (got[i].distance != expected[i].distance || id != expected_id)
        return text("number ", i, ": ", got[i].distance, " id ", id, ", but the list says ", expected[i].distance,
                    " id ", expected_id);
    }
    return "";
  }

  // Returns the first violation of the contract of visit_nearest(); empty if there is none. The index must pass every
  // value whose bounds have a squared distance of at most `limit`, pass no value twice, and count one test for each
  // value that it passes.
  std::string broken_point_contract(const Vec3d& point, double limit) const {
    Recorder<double> recorder(limit);
    Work work;
    index_.visit_nearest(point, recorder, work);
    const std::vector<uint64_t> ids = recorder.sorted_ids();
    if (std::adjacent_find(ids.begin(), ids.end()) != ids.end()) return "a value near a point was handed over twice";
    if (work.tests != ids.size()) return text("counted ", work.tests, " tests for ", ids.size(), " values");
    for (const Value& value : oracle_.values()) {
      const double away = squared_distance(point, to_double(Traits::bounds(value)));
      if (away <= limit && !std::binary_search(ids.begin(), ids.end(), Traits::id(value)))
        return text("id ", Traits::id(value), " as far as ", away, " was not handed over up to ", limit);
    }
    return "";
  }

  template <class Exact, class Conservative>
  std::string overlap_difference(const Exact& exact, const Conservative& conservative) const {
    std::vector<Value> got, expected, got_bounds, expected_bounds;
    exact(index_, got);
    exact(oracle_, expected);
    conservative(index_, got_bounds);
    conservative(oracle_, expected_bounds);
    if (std::string what = list_difference(sorted_ids(got), sorted_ids(expected)); !what.empty())
      return "exact " + what;
    const std::vector<uint64_t> exact_ids = sorted_ids(expected), bounds_ids = sorted_ids(expected_bounds);
    if (!std::includes(bounds_ids.begin(), bounds_ids.end(), exact_ids.begin(), exact_ids.end()))
      return "the conservative answer lacks part of the exact one";
    const std::string what = list_difference(sorted_ids(got_bounds), bounds_ids);
    return what.empty() ? "" : "conservative " + what;
  }

  const Index& index_;
  const ListIndex<Value, Traits>& oracle_;
};

// Returns the first difference between `index` and the list of the same values over all queries of `scene`; empty if
// there is none.
template <SpatialIndex Index>
std::string first_difference(const Index& index, const TestScene<typename Index::Value>& scene) {
  const auto oracle = make_list(scene.values);
  return IndexJudge(index, oracle).difference(scene);
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_INDEX_JUDGE_H_
