// Families of points for testing the nearest kernels: each family is known to reveal one kind of error. The points are
// generated from seeds. Used by the tests of the nearest kernels and of planted bugs in them.
#ifndef LOCUS_TESTS_SUPPORT_NEAREST_TRIALS_H_
#define LOCUS_TESTS_SUPPORT_NEAREST_TRIALS_H_

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/geometry/point_triangle.h"
#include "core/query/kinds/nearest_triangles.h"
#include "tests/support/random_region.h"
#include "tests/support/test_scale.h"

namespace locus::test {

// Arguments of searches from one point in mesh axes. A search must return all triangles within `limit`. A search for
// only the nearest triangle must return this triangle, and all triangles that are farther away by at most `slack`.
struct NearestTarget {
  Vec3d point;
  double limit = std::numeric_limits<double>::infinity();
  double slack = 0;
};

// A mesh and points. The expected answers are computed in double from the list of all triangles. Immutable.
class NearestTrial {
 public:
  NearestTrial(std::string name, const std::vector<Triangle>& triangles, std::vector<NearestTarget> targets)
      : name_(std::move(name)), tree_(*TriangleBvh::build(triangles)), targets_(std::move(targets)) {
    tree_.for_each([&](const Triangle& triangle) { triangles_.push_back(triangle); });
  }

  // Returns the first wrong answer; empty if there is none. Adds to `searches` the number of searches for the nearest
  // triangle, and to `candidates` the number of candidates that these searches returned.
  std::string difference(const NearestKernels& kernels, uint64_t* candidates = nullptr,
                         uint64_t* searches = nullptr) const {
    for (size_t i = 0; i < targets_.size(); ++i) {
      const NearestTarget& target = targets_[i];
      std::vector<double> distances;
      double least = std::numeric_limits<double>::infinity();
      for (const Triangle& triangle : triangles_) {
        distances.push_back(std::sqrt(squared_distance(target.point, triangle)));
        least = std::min(least, distances.back());
      }
      const double nearest_limit = least * (1 + 0x1p-20) + target.slack;
      for (const NearestSearch::Find find : {NearestSearch::Find::kEvery, NearestSearch::Find::kNearest}) {
        const bool nearest = find == NearestSearch::Find::kNearest;
        NearestSearch search(kernels, tree_, target.point, target.limit, find, target.slack);
        const double limit = nearest ? std::min(target.limit, nearest_limit) : target.limit;
        const std::string what = fault(search, target, distances, limit, nearest ? candidates : nullptr);
        if (!what.empty()) return absl::StrCat(name_, ", point ", i, nearest ? ", nearest: " : ", every: ", what);
        if (nearest && searches != nullptr) ++*searches;
      }
    }
    return "";
  }

 private:
  // Returns a description of the error in the candidates of a search: a triangle within `limit` is missing, a triangle
  // is returned twice, or a distance differs from that of the functions of core/geometry.
  std::string fault(NearestSearch& search, const NearestTarget& target, const std::vector<double>& distances,
                    double limit, uint64_t* candidates) const {
    std::vector<int> times(triangles_.size());
    NearestSearch::Squared squared;
    const Transform transform = placement(target.point);
    const Vec3d point = transform.point_to_world(target.point);
    while (!search.over()) {
      search.next();
      search.measure(point, transform, kEpsilon, squared);
      for (uint32_t i = 0; i < search.found(); ++i) {
        ++times.at(search.number(i));
        const Triangle triangle = search.triangle(i);
        if (triangle.number != search.number(i)) return "a wrong number";
        if (std::bit_cast<uint64_t>(squared[i]) != std::bit_cast<uint64_t>(measured(point, transform, triangle)))
          return absl::StrCat("triangle ", triangle.number, " at the square of ", std::sqrt(squared[i]));
      }
      if (candidates != nullptr) *candidates += search.found();
    }
    for (size_t i = 0; i < triangles_.size(); ++i) {
      const int found = times[triangles_[i].number];
      if (found > 1) return absl::StrCat("triangle ", triangles_[i].number, " twice");
      if (found == 0 && distances[i] <= limit)
        return absl::StrCat("no triangle ", triangles_[i].number, " at ", distances[i], " within ", limit);
    }
    return "";
  }

  // Returns a placement that depends on the point.
  static Transform placement(Vec3d point) {
    Random random(std::bit_cast<uint64_t>(point.x));
    return make_transform(random.vector(100), random.rotation(), static_cast<float>(random.magnitude(-3, 3)));
  }
  static double measured(Vec3d point, const Transform& transform, const Triangle& triangle) {
    const Corners corners = {transform.point_to_world(to_double(triangle.a)),
                             transform.point_to_world(to_double(triangle.b)),
                             transform.point_to_world(to_double(triangle.c))};
    Aabbd bounds;
    for (const Vec3d corner : corners) bounds = merge(bounds, corner);
    return std::max(squared_distance(point, grown(bounds, kEpsilon)),
                    squared_distance(point, corners[0], corners[1], corners[2]));
  }

  static constexpr double kEpsilon = 0x1p-33;

  std::string name_;
  TriangleBvh tree_;
  std::vector<Triangle> triangles_;
  std::vector<NearestTarget> targets_;
};

// Makes `count` points around the mesh. Most limits are the distance of a triangle, computed in double, so that the
// distance bounds that a kernel computes in float are close to the limit on either side.
inline NearestTrial random_nearest_trial(std::string name, const std::vector<Triangle>& mesh, size_t count,
                                         uint64_t seed) {
  RandomRegions regions(mesh, seed);
  Random random(seed);
  std::vector<NearestTarget> targets;
  for (size_t i = 0; i < count; ++i) {
    NearestTarget target{to_double(regions.ball().center)};
    if (random.chance(0.5)) target.point = target.point * (1 + random.between(-1, 1) * 0x1p-24);
    const Triangle& triangle = random.pick(mesh);
    if (random.chance(0.1)) target.point = to_double(triangle.a);
    const double distance = std::sqrt(squared_distance(target.point, triangle));
    if (random.chance(0.8)) target.limit = distance;
    if (random.chance(0.5)) target.slack = distance * random.magnitude(-30, -1);
    targets.push_back(target);
  }
  return NearestTrial(std::move(name), mesh, std::move(targets));
}

inline std::vector<NearestTrial> ordinary_nearest_trials() {
  std::vector<NearestTrial> trials;
  trials.push_back(random_nearest_trial("sphere", bumpy_sphere(10, 0.1, 1), scaled_count(2'000), 1));
  trials.push_back(random_nearest_trial("city", box_city(3, 1), scaled_count(2'000), 2));
  return trials;
}

// Makes small, thin and degenerate triangles beside large ones, so that the triangles of a block differ greatly.
inline std::vector<NearestTrial> uneven_nearest_trials() {
  Random random(10);
  std::vector<Triangle> sizes, slivers;
  for (int i = 0; i < 400; ++i) {
    const Vec3f a = random.float_vector(1), along = random.float_vector(random.chance(0.2) ? 1e-3 : 1);
    const double size = random.magnitude(-12, 1);
    sizes.push_back({a, a + random.float_vector(size), a + random.float_vector(size)});
    const Vec3f off = random.float_vector(random.magnitude(-40, -4));
    slivers.push_back({a, a + along, a + along * 0.5f + (random.chance(0.1) ? Vec3f{} : off)});
    if (random.chance(0.1)) slivers.back() = {a, a, a};
    if (random.chance(0.1)) slivers.back() = {a, a + along, a};
  }
  number_in_order(sizes);
  number_in_order(slivers);
  std::vector<NearestTrial> trials;
  trials.push_back(random_nearest_trial("triangles of many sizes", sizes, scaled_count(1'500), 11));
  trials.push_back(random_nearest_trial("slivers", slivers, scaled_count(1'500), 12));
  return trials;
}

// Makes trials at many scales; at some scales, squares and products underflow. Also makes trials far from the origin;
// in the farthest trial, the rounding of a point to float is about as large as a triangle.
inline std::vector<NearestTrial> scaled_nearest_trials() {
  std::vector<NearestTrial> trials;
  const std::vector<Triangle> sphere = bumpy_sphere(4, 0.1, 1);
  for (int exponent = -140; exponent <= 24; exponent += 4)
    trials.push_back(random_nearest_trial(absl::StrCat("sphere times 2^", exponent),
                                          moved(sphere, std::ldexp(1.0f, exponent), {}), scaled_count(100),
                                          static_cast<uint64_t>(exponent + 200)));
  for (const float distance : {1e3f, 1e5f, 1e7f})
    trials.push_back(random_nearest_trial(absl::StrCat("sphere at ", distance),
                                          moved(sphere, 1, {distance, -2 * distance, distance / 2}), scaled_count(300),
                                          13));
  return trials;
}

// Makes meshes that consist of a single point. The box of such a mesh has no extent, so the distances to the box and to
// the triangle are equal. This distance is the limit of the search. The queries are so near to the origin that the pad
// of their points is small. So only the pad of boxes prevents the search from dropping a box whose squared distance is
// rounded up.
inline std::vector<NearestTrial> point_nearest_trials() {
  Random random(20);
  std::vector<NearestTrial> trials;
  for (size_t i = 0; i < scaled_count(40'000); ++i) {
    const Vec3f at = random.float_vector(1);
    const std::vector<Triangle> point = {{at, at, at, 0}};
    const Vec3d from = to_double(random.float_vector(0x1p-10));
    trials.emplace_back(absl::StrCat("point ", i), point,
                        std::vector<NearestTarget>{{from, std::sqrt(squared_length(to_double(at) - from))}});
  }
  return trials;
}

// Makes fans of triangles around one vertex, and points at and above this vertex: all triangles of a fan are equally
// near.
inline std::vector<NearestTrial> tied_nearest_trials() {
  Random random(30);
  std::vector<NearestTrial> trials;
  for (size_t i = 0; i < scaled_count(400); ++i) {
    const Vec3f tip = random.float_vector(1);
    std::vector<Triangle> fan;
    std::vector<Vec3f> rim;
    for (int corner = 0; corner < 12; ++corner) rim.push_back(tip + random.float_vector(1) - Vec3f{2, 0, 0});
    for (size_t corner = 0; corner < rim.size(); ++corner)
      fan.push_back({rim[corner], tip, rim[(corner + 1) % rim.size()], 0});
    number_in_order(fan);
    const Vec3d above = to_double(tip) + Vec3d{random.magnitude(-20, 4), 0, 0};
    trials.emplace_back(absl::StrCat("fan ", i), fan, std::vector<NearestTarget>{{to_double(tip)}, {above}});
  }
  return trials;
}

inline std::vector<NearestTrial> all_nearest_trials() {
  std::vector<NearestTrial> trials;
  for (std::vector<NearestTrial> (*const make)() : {ordinary_nearest_trials, uneven_nearest_trials,
                                                    scaled_nearest_trials, point_nearest_trials, tied_nearest_trials})
    for (NearestTrial& trial : make()) trials.push_back(std::move(trial));
  return trials;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_NEAREST_TRIALS_H_
