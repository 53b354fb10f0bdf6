// Families of balls and boxes for testing the region kernels: each family is known to reveal one kind of error. The
// regions are generated from seeds. Used by the tests of planted bugs in the region kernels.
#ifndef LOCUS_TESTS_SUPPORT_REGION_TRIALS_H_
#define LOCUS_TESTS_SUPPORT_REGION_TRIALS_H_

#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/index/bvh/kernels/region_kernels.h"
#include "core/query/kinds/triangle_search.h"
#include "tests/support/random_region.h"
#include "tests/support/test_scale.h"

namespace locus::test {

// A mesh, balls and boxes, and the expected answers: for each ball and box, the numbers of the triangles that overlap
// it according to the predicates of core/geometry. Immutable.
class RegionTrial {
 public:
  RegionTrial(std::string name, const std::vector<Triangle>& triangles, std::vector<Ballf> balls,
              std::vector<Obbf> boxes)
      : RegionTrial(std::move(name), *TriangleBvh::build(triangles), std::move(balls), std::move(boxes)) {}
  RegionTrial(std::string name, TriangleBvh tree, std::vector<Ballf> balls, std::vector<Obbf> boxes)
      : name_(std::move(name)), tree_(std::move(tree)), balls_(std::move(balls)), boxes_(std::move(boxes)) {
    for (const Ballf& ball : balls_)
      answers_.push_back(answer([&](const Triangle& triangle) { return ball_overlaps(ball, triangle); }));
    for (const Obbf& box : boxes_)
      answers_.push_back(answer([&](const Triangle& triangle) { return box_overlaps(box, triangle); }));
  }

  // Returns the first wrong answer; empty if there is none.
  std::string difference(const RegionKernels& kernels) const {
    for (size_t i = 0; i < balls_.size(); ++i)
      if (found(kernels.ball, balls_[i]) != answers_[i]) return absl::StrCat(name_, ", ball ", i);
    for (size_t i = 0; i < boxes_.size(); ++i) {
      const RegionKernel<KernelBox>& kernel = boxes_[i].rotation == Rotation{} ? kernels.box : kernels.turned_box;
      if (found(kernel, boxes_[i]) != answers_[balls_.size() + i]) return absl::StrCat(name_, ", box ", i);
    }
    return "";
  }

 private:
  template <class Meets>
  std::vector<uint32_t> answer(Meets meets) const {
    std::vector<uint32_t> numbers;
    tree_.for_each([&](const Triangle& triangle) {
      if (meets(triangle)) numbers.push_back(triangle.number);
    });
    return numbers;
  }

  template <class Region, class Shape>
  std::vector<uint32_t> found(const RegionKernel<Region>& kernel, const Shape& shape) const {
    std::vector<uint32_t> numbers(tree_.size() + kMinRegionRoom);
    uint32_t count = 0;
    const Region region = kernel_region(shape);
    const RegionPredicate judge = predicate_of(shape);
    kernel.many(tree_.tree(), &region, &judge, 1, numbers.data(), numbers.size(), &count);
    numbers.resize(count);
    return numbers;
  }

  std::string name_;
  TriangleBvh tree_;
  std::vector<Ballf> balls_;
  std::vector<Obbf> boxes_;
  std::vector<std::vector<uint32_t>> answers_;  // answers for the balls, then for the boxes
};

// Makes `count` regions of every kind. `tree` must be a tree of `mesh`.
inline RegionTrial random_region_trial(std::string name, const std::vector<Triangle>& mesh, TriangleBvh tree,
                                       size_t count, uint64_t seed) {
  RandomRegions regions(mesh, seed);
  std::vector<Ballf> balls;
  std::vector<Obbf> boxes;
  for (size_t i = 0; i < count; ++i) {
    balls.insert(balls.end(), {regions.ball(), regions.touching_ball()});
    boxes.insert(boxes.end(),
                 {regions.box(false), regions.box(true), regions.touching_box(false), regions.touching_box(true)});
  }
  return RegionTrial(std::move(name), std::move(tree), std::move(balls), std::move(boxes));
}

inline RegionTrial random_region_trial(std::string name, const std::vector<Triangle>& mesh, size_t count,
                                       uint64_t seed) {
  return random_region_trial(std::move(name), mesh, *TriangleBvh::build(mesh), count, seed);
}

inline std::vector<RegionTrial> ordinary_region_trials() {
  std::vector<RegionTrial> trials;
  trials.push_back(random_region_trial("sphere", bumpy_sphere(10, 0.1, 1), scaled_count(4'000), 1));
  trials.push_back(random_region_trial("city", box_city(3, 1), scaled_count(3'000), 2));
  return trials;
}

// Makes small and large triangles side by side, so that the triangles of a block differ greatly in size.
inline RegionTrial mixed_region_trial() {
  Random random(10);
  std::vector<Triangle> mixed;
  for (int i = 0; i < 600; ++i) {
    const Vec3f a = random.float_vector(1);
    const double size = random.magnitude(-12, 1);
    mixed.push_back({a, a + random.float_vector(size), a + random.float_vector(size)});
  }
  number_in_order(mixed);
  return random_region_trial("triangles of many sizes", mixed, scaled_count(4'000), 11);
}

// Makes trials at many scales: the smaller the scale, the more squares and products of lengths underflow.
inline std::vector<RegionTrial> small_region_trials() {
  std::vector<RegionTrial> trials;
  const std::vector<Triangle> sphere = bumpy_sphere(4, 0.1, 1);
  for (int exponent = -110; exponent <= -20; exponent += 2)
    trials.push_back(random_region_trial(absl::StrCat("sphere times 2^", exponent),
                                         moved(sphere, std::ldexp(1.0f, exponent), {}), scaled_count(200),
                                         static_cast<uint64_t>(-exponent)));
  return trials;
}

// Makes meshes of one point, whose box has no extent. Because of rounding, a region that touches the point may miss
// this box and meet only the padded box.
inline std::vector<RegionTrial> point_region_trials() {
  Random random(20);
  std::vector<RegionTrial> trials;
  for (size_t i = 0; i < scaled_count(2'000); ++i) {
    const Vec3f at = random.float_vector(1), away = random.float_vector(1);
    const std::vector<Triangle> point = {{at, at, at, 0}};
    Ballf ball{away, static_cast<float>(std::sqrt(squared_distance(to_double(away), point[0])))};
    std::vector<Ballf> balls = {ball};
    std::vector<Obbf> boxes;
    for (int turned = 0; turned < 8; ++turned) {
      Obbf box{away, random.float_vector(1), turned == 0 ? Rotation{} : rotation_of(random.rotation())};
      box.half = to_float(abs(to_double(box.half)));
      box.half = box.half * static_cast<float>(touching_scale(box, point[0]));
      boxes.push_back(box);
    }
    trials.emplace_back(absl::StrCat("point ", i), point, balls, boxes);
  }
  return trials;
}

// Makes slivers that an edge of a box touches in the middle. One edge of each sliver is so short that products with its
// length underflow. All coordinates are whole multiples of a small unit, so that the computation is exact.
inline std::vector<RegionTrial> short_edge_region_trials() {
  Random random(21);
  std::vector<RegionTrial> trials;
  for (size_t i = 0; i < scaled_count(600); ++i) {
    const auto length = [&] { return static_cast<float>(2 * random.whole(1, 500)) * 0x1p-46f; };
    const Vec3f end = {length(), length(), -length()}, middle = end * 0.5f;
    const float part = std::ldexp(1.0f, random.whole(-74, -64));
    const Vec3f half = {length() + end.x, length(), length()};
    const Obbf box = {{middle.x, middle.y + half.y, middle.z + half.z}, half, {}};
    const std::vector<Triangle> sliver = {{{0, 0, 0}, end * part, end, 0}};
    trials.emplace_back(absl::StrCat("short edge ", i), sliver, std::vector<Ballf>{}, std::vector<Obbf>{box});
  }
  return trials;
}

// Makes balls that touch narrow triangles at a point near one edge, while the two other edges are near as well.
inline std::vector<RegionTrial> narrow_region_trials() {
  Random random(12);
  std::vector<RegionTrial> trials;
  for (size_t i = 0; i < scaled_count(20'000); ++i) {
    const Vec3d a = random.vector(1), along = random.vector(1), aside = random.unit_vector();
    const double width = random.magnitude(-16, -4);
    const std::vector<Triangle> narrow = {
        {to_float(a), to_float(a + along), to_float(a + along * random.unit() + aside * width), 0}};
    const Vec3d beside = a + along * random.unit() + aside * (width * random.between(-0.01, 0.01));
    const Vec3d above = normalized(cross(along, aside)) * (random.chance(0.3) ? 0 : random.magnitude(-24, -2));
    Ballf ball{to_float(beside + above), 0};
    const double distance = std::sqrt(squared_distance(to_double(ball.center), narrow[0]));
    ball.radius =
        static_cast<float>(distance * random.pick(std::vector<double>{1, 1, 1 - 0x1p-20, 1 + 0x1p-20, 1 - 0x1p-10}));
    trials.emplace_back(absl::StrCat("narrow ", i), narrow, std::vector<Ballf>{ball}, std::vector<Obbf>{});
  }
  return trials;
}

inline std::vector<RegionTrial> all_region_trials() {
  std::vector<RegionTrial> trials = ordinary_region_trials();
  trials.push_back(mixed_region_trial());
  for (std::vector<RegionTrial> (*const make)() :
       {small_region_trials, point_region_trials, short_edge_region_trials, narrow_region_trials})
    for (RegionTrial& trial : make()) trials.push_back(std::move(trial));
  return trials;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_REGION_TRIALS_H_
