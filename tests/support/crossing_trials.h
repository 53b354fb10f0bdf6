// Meshes and points for testing the crossings of half lines, from which winding numbers are computed. Each family is
// known to reveal one kind of error. The points are generated from seeds. Used by the tests of the crossing kernels, of
// TriangleBvh::visit_half_line(), and of planted bugs in both.
#ifndef LOCUS_TESTS_SUPPORT_CROSSING_TRIALS_H_
#define LOCUS_TESTS_SUPPORT_CROSSING_TRIALS_H_

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/types/span.h"
#include "core/query/kinds/winding_search.h"
#include "tests/support/half_lines.h"
#include "tests/support/random_region.h"
#include "tests/support/test_scale.h"

namespace locus::test {

// Sums over the searches of a trial: number of searches, of tested triangles, and of tested triangles for which the
// kernel called the exact predicate of the visit.
struct CrossingCost {
  uint64_t searches = 0, tests = 0, exact_tests = 0;
};

// A mesh, which need not be closed, and points in mesh axes. The expected answers are the sums of crossing() over the
// list of all triangles. Immutable.
class CrossingTrial {
 public:
  CrossingTrial(std::string name, const std::vector<Triangle>& triangles, std::vector<Vec3d> points)
      : name_(std::move(name)), tree_(*TriangleBvh::build(triangles)), points_(std::move(points)) {
    for (Vec3d& point : points_) point = without_tiny_coordinates(point);
    tree_.for_each([&](const Triangle& triangle) { triangles_.push_back(triangle); });
  }

  // Returns the first half line for which TriangleBvh::visit_half_line() gives a wrong sum; empty if there is none.
  std::string difference() const {
    return first_fault([this](Vec3d point, HalfLine line, const Sum& expected) {
      Sum found(point, line);
      Work work;
      tree_.visit_half_line(HalfLineBoxes(point, line), found, work);
      return fault(expected, found.on_surface, found.winding);
    });
  }

  // Returns the first half line for which the kernel gives a wrong sum, or its cost differs from that of
  // visit_half_line(); empty if there is none.
  std::string difference(const CrossingKernels& kernels, CrossingCost* cost = nullptr) const {
    return first_fault([&](Vec3d point, HalfLine line, const Sum& expected) -> std::string {
      WindingSearch search(kernels, tree_, point, WindingWay::out(line));
      Work spent, work;
      while (!search.over()) {
        search.next();
        spent.nodes += search.nodes();
        spent.tests += search.tests();
        if (cost != nullptr) cost->exact_tests += search.exact_tests();
      }
      if (std::string what = fault(expected, search.on_surface(), search.winding()); !what.empty()) return what;
      Sum found(point, line);
      tree_.visit_half_line(HalfLineBoxes(point, line), found, work);
      if (spent.nodes != work.nodes || spent.tests != work.tests)
        return absl::StrCat(spent.nodes, " nodes and ", spent.tests, " tests, not ", work.nodes, " and ", work.tests);
      if (cost != nullptr) cost->tests += spent.tests, ++cost->searches;
      return "";
    });
  }

  // Returns the first point whose winding number is wrong when searches end early, at clear cells (WindingCells); empty
  // if there is none. `known` counts the points that need no search. `kernels` may be null. The mesh must be closed.
  std::string difference_with_cells(const CrossingKernels* kernels, size_t* known = nullptr) const {
    const WindingCells cells = WindingCells::build(tree_);
    return first_fault([&](Vec3d point, HalfLine line, const Sum& expected) -> std::string {
      const WindingWay way = cells.way_from(tree_, point);
      if (way.is_known) {
        if (known != nullptr && line.axis == 0 && !line.descending) ++*known;
        return fault(expected, false, way.winding);
      }
      Sum found(point, way.line);
      Work work;
      tree_.visit_half_line(HalfLineBoxes(point, way.line, way.end), found, work);
      if (std::string what = fault(expected, found.on_surface, way.winding + found.winding); !what.empty()) return what;
      if (kernels == nullptr) return "";
      WindingSearch search(*kernels, tree_, point, way);
      Work spent;
      while (!search.over()) {
        search.next();
        spent.nodes += search.nodes();
        spent.tests += search.tests();
      }
      if (spent.nodes != work.nodes || spent.tests != work.tests)
        return absl::StrCat(spent.nodes, " nodes and ", spent.tests, " tests, not ", work.nodes, " and ", work.tests);
      return fault(expected, search.on_surface(), search.winding());
    });
  }

 private:
  // Visitor of triangles that sums their crossings.
  struct Sum {
    Sum(Vec3d from, HalfLine towards) : point(from), line(towards) {}
    bool visit(const Triangle& triangle) {
      const Crossing one = crossing(point, triangle, line);
      on_surface |= one.on_surface;
      winding += one.winding;
      return !on_surface;
    }

    Vec3d point;
    HalfLine line;
    bool on_surface = false;
    int64_t winding = 0;
  };

  template <class Fault>
  std::string first_fault(const Fault& fault_of) const {
    for (size_t i = 0; i < points_.size(); ++i) {
      for (const HalfLine line : kHalfLines) {
        Sum expected(points_[i], line);
        for (const Triangle& triangle : triangles_)
          if (!expected.visit(triangle)) break;
        if (const std::string what = fault_of(points_[i], line, expected); !what.empty())
          return absl::StrCat(name_, ", point ", i, line.descending ? ", down" : ", up", " axis ", line.axis, ": ",
                              what);
      }
    }
    return "";
  }

  static std::string fault(const Sum& expected, bool on_surface, int64_t winding) {
    if (on_surface != expected.on_surface) return on_surface ? "on the surface" : "not on the surface";
    if (!on_surface && winding != expected.winding)
      return absl::StrCat("winding ", winding, ", not ", expected.winding);
    return "";
  }

  std::string name_;
  TriangleBvh tree_;
  std::vector<Triangle> triangles_;
  std::vector<Vec3d> points_;
};

// Returns a point on a corner, on an edge or inside a triangle, or displaced from such a point along an axis. Half of
// the points have float coordinates.
inline Vec3d point_at(const Triangle& triangle, Random& random) {
  const Corners corners = corners_of(triangle);
  const Vec3d a = random.pick(corners), b = random.pick(corners), c = random.pick(corners);
  const double s = random.chance(0.3) ? 0 : random.unit(), t = random.chance(0.7) ? 0 : random.unit() * (1 - s);
  Vec3d point = a + (b - a) * s + (c - a) * t;
  if (random.chance(0.7)) {
    const double size = max_component(abs(corners[1] - corners[0])) + max_component(abs(corners[2] - corners[0]));
    point[random.whole(0, 2)] += random.between(-1, 1) * random.magnitude(-20, 1) * size;
  }
  return random.chance(0.5) ? to_double(to_float(point)) : point;
}

// Makes a trial with `count` points: most are at random triangles, the others anywhere in the bounds of the mesh.
inline CrossingTrial random_crossing_trial(std::string name, const std::vector<Triangle>& mesh, size_t count,
                                           uint64_t seed) {
  RandomRegions regions(mesh, seed);
  Random random(seed);
  std::vector<Vec3d> points;
  for (size_t i = 0; i < count; ++i)
    points.push_back(random.chance(0.8) ? point_at(random.pick(mesh), random) : to_double(regions.ball().center));
  return CrossingTrial(std::move(name), mesh, std::move(points));
}

// Returns triangles of many sizes, of which some are thin or have no area.
inline std::vector<Triangle> triangle_soup(size_t count, uint64_t seed) {
  Random random(seed);
  std::vector<Triangle> soup;
  for (size_t i = 0; i < count; ++i) {
    const Vec3f a = random.float_vector(1);
    const double size = random.magnitude(-8, 0);
    Triangle triangle{a, a + random.float_vector(size), a + random.float_vector(size)};
    if (random.chance(0.1)) triangle.c = triangle.a + (triangle.b - triangle.a) * 0.5f + random.float_vector(1e-6);
    if (random.chance(0.05)) triangle.c = triangle.b;
    if (random.chance(0.2)) {
      const int axis = random.whole(0, 2);
      triangle.a[axis] = triangle.b[axis] = triangle.c[axis];
    }
    soup.push_back(triangle);
  }
  number_in_order(soup);
  return soup;
}

inline std::vector<CrossingTrial> ordinary_crossing_trials() {
  std::vector<CrossingTrial> trials;
  trials.push_back(random_crossing_trial("sphere", bumpy_sphere(10, 0.1, 1), scaled_count(1'000), 1));
  trials.push_back(random_crossing_trial("city", box_city(3, 1), scaled_count(1'000), 2));
  trials.push_back(random_crossing_trial("soup", triangle_soup(300, 3), scaled_count(2'000), 3));
  return trials;
}

// Makes trials at many scales; at some scales, products underflow or overflow. Also makes trials far from the origin;
// in the farthest trial, the rounding of a point to float exceeds the size of a triangle.
inline std::vector<CrossingTrial> scaled_crossing_trials() {
  std::vector<CrossingTrial> trials;
  const std::vector<Triangle> soup = triangle_soup(30, 4);
  for (int exponent = -140; exponent <= 120; exponent += 4)
    trials.push_back(random_crossing_trial(absl::StrCat("soup times 2^", exponent),
                                           moved(soup, std::ldexp(1.0f, exponent), {}), scaled_count(200),
                                           static_cast<uint64_t>(exponent + 200)));
  for (int exponent = -76; exponent <= -60; ++exponent)
    trials.push_back(random_crossing_trial(absl::StrCat("soup that underflows at 2^", exponent),
                                           moved(soup, std::ldexp(1.0f, exponent), {}), scaled_count(1'000),
                                           static_cast<uint64_t>(exponent + 400)));
  for (const float distance : {1e3f, 1e5f, 1e7f})
    trials.push_back(random_crossing_trial(absl::StrCat("soup at ", distance),
                                           moved(soup, 1, {distance, -2 * distance, distance / 2}), scaled_count(1'000),
                                           5));
  return trials;
}

// Makes triangles whose coordinates on one axis are a few float steps apart, and points between these steps: if a point
// were rounded to float, it would be on the wrong side of a vertex.
inline std::vector<CrossingTrial> stepped_crossing_trials() {
  Random random(6);
  std::vector<CrossingTrial> trials;
  for (size_t i = 0; i < scaled_count(2'000); ++i) {
    const int axis = random.whole(0, 2);
    const auto step = [&] { return 1 + random.between(0, 3) * 0x1p-23; };
    const auto corner = [&] {
      Vec3f at = random.float_vector(1);
      at[axis] = static_cast<float>(step());
      return at;
    };
    const Triangle triangle{corner(), corner(), corner(), 0};
    std::vector<Vec3d> points;
    for (int k = 0; k < 10; ++k) {
      points.push_back(point_at(triangle, random));
      points.back()[axis] = step();
    }
    trials.emplace_back(absl::StrCat("steps ", i), std::vector<Triangle>{triangle}, std::move(points));
  }
  return trials;
}

// Joins the triangles of several closed meshes into one mesh, which is closed, too.
inline std::vector<Triangle> joined(const std::vector<std::vector<Triangle>>& meshes) {
  std::vector<Triangle> all;
  for (const std::vector<Triangle>& mesh : meshes) all.insert(all.end(), mesh.begin(), mesh.end());
  number_in_order(all);
  return all;
}

// Returns the mesh with the opposite orientation.
inline std::vector<Triangle> turned_inside_out(std::vector<Triangle> mesh) {
  for (Triangle& triangle : mesh) std::swap(triangle.b, triangle.c);
  return mesh;
}

// Returns a city of box_city() whose triangles all face outward, so that its houses have an inside.
inline std::vector<Triangle> outward_city(int side, uint64_t seed) {
  constexpr size_t kTrianglesAHouse = 12;
  std::vector<Triangle> city = box_city(side, seed);
  for (size_t first = 0; first < city.size(); first += kTrianglesAHouse) {
    const absl::Span<Triangle> house(&city[first], kTrianglesAHouse);
    Aabbf bounds = bounds_of(house[0]);
    for (const Triangle& triangle : house) bounds = merge(bounds, bounds_of(triangle));
    const Vec3d center = (to_double(bounds.min) + to_double(bounds.max)) * 0.5;
    for (Triangle& triangle : house) {
      const Corners corners = corners_of(triangle);
      const Vec3d normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
      if (dot(normal, corners[0] - center) < 0) std::swap(triangle.b, triangle.c);
    }
  }
  return city;
}

// Makes trials of closed meshes: meshes with winding numbers other than 0 and 1, a flat mesh, a mesh of many separate
// spheres, a city, meshes of extreme sizes, and meshes far from the origin. At the farthest mesh, cells are smaller
// than the spacing of floats.
inline std::vector<CrossingTrial> closed_crossing_trials() {
  const std::vector<Triangle> sphere = bumpy_sphere(12, 0.2, 7), inner = moved(bumpy_sphere(6, 0.1, 8), 0.4f, {});
  std::vector<std::vector<Triangle>> crowd, stack;
  for (int i = 0; i < 1'331; ++i) {
    const Vec3f at{static_cast<float>(i % 11), static_cast<float>(i / 11 % 11), static_cast<float>(i / 121)};
    crowd.push_back(moved(bumpy_sphere(3, 0.1, static_cast<uint64_t>(i)), 0.4f, at));
  }
  for (int i = 0; i < 70; ++i) stack.push_back(moved(inner, 1 + static_cast<float>(i) / 16, {}));
  std::vector<CrossingTrial> trials;
  const auto add = [&](const char* name, const std::vector<Triangle>& mesh, size_t points) {
    trials.push_back(random_crossing_trial(name, mesh, scaled_count(points), trials.size() + 20));
  };
  add("sphere with cells", sphere, 2'000);
  add("sphere in a sphere", joined({sphere, inner}), 2'000);
  add("hollow sphere", joined({sphere, turned_inside_out(inner)}), 2'000);
  add("sphere turned inside out", turned_inside_out(sphere), 500);
  add("more spheres than a cell can count", joined(stack), 200);
  add("more spheres than sets of cells", joined(crowd), 200);
  add("city with cells", outward_city(4, 2), 1'000);
  std::vector<Triangle> flat = sphere;
  for (Triangle& triangle : flat)
    for (Vec3f* corner : {&triangle.a, &triangle.b, &triangle.c}) corner->z = 0;
  add("flat", flat, 500);
  for (const int exponent : {-140, -100, -20, 60, 120})
    add("sphere with cells, scaled", moved(sphere, std::ldexp(1.0f, exponent), {}), 200);
  for (const float distance : {1e3f, 1e6f, 1e7f})
    add("sphere with cells, far away", moved(sphere, 1, {distance, -2 * distance, distance / 2}), 200);
  return trials;
}

inline std::vector<CrossingTrial> all_crossing_trials() {
  std::vector<CrossingTrial> trials;
  for (std::vector<CrossingTrial> (*const make)() :
       {ordinary_crossing_trials, scaled_crossing_trials, stepped_crossing_trials})
    for (CrossingTrial& trial : make()) trials.push_back(std::move(trial));
  return trials;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_CROSSING_TRIALS_H_
