// Compares the region kernels of every instruction set with tests of all triangles one by one.
#include "core/index/bvh/kernels/region_kernels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/index/bvh/kernels/dispatch.h"
#include "core/query/kinds/triangle_search.h"
#include "tests/support/random_region.h"
#include "tests/support/test_scale.h"
#include "tests/support/vector_sets.h"

namespace locus::test {
namespace {

bool meets(const Ballf& ball, const Triangle& triangle) { return ball_overlaps(ball, triangle); }
bool meets(const Obbf& box, const Triangle& triangle) { return box_overlaps(box, triangle); }

std::string described(const Ballf& b) {
  return testing::PrintToString(std::vector<float>{b.center.x, b.center.y, b.center.z, b.radius});
}
std::string described(const Obbf& b) {
  return testing::PrintToString(std::vector<float>{b.center.x, b.center.y, b.center.z, b.half.x, b.half.y, b.half.z});
}

class RegionKernelsTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    ASSERT_TRUE(use_instruction_set(GetParam()).ok());
    ASSERT_NE(active_region_kernels(), nullptr);
  }
  void TearDown() override { ASSERT_TRUE(use_instruction_set("").ok()); }

  // Compares the kernels with the predicates for `count` regions of each of six kinds: balls, boxes and rotated boxes,
  // at random or just touching a triangle.
  void compare(const std::vector<Triangle>& triangles, size_t count, uint64_t seed) {
    const absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(triangles);
    ASSERT_TRUE(tree.ok()) << tree.status();
    RandomRegions regions(triangles, seed);
    for (size_t i = 0; i < count && !HasFailure(); ++i) {
      compare_one(*tree, regions.ball());
      compare_one(*tree, regions.touching_ball());
      compare_one(*tree, regions.box(false));
      compare_one(*tree, regions.box(true));
      compare_one(*tree, regions.touching_box(false));
      compare_one(*tree, regions.touching_box(true));
    }
  }

  template <class Shape>
  void compare_one(const TriangleBvh& tree, const Shape& shape) {
    ASSERT_TRUE(TriangleSearch<Shape>::served(tree, shape));
    std::vector<uint32_t> expected, found;
    tree.for_each([&](const Triangle& triangle) {
      if (meets(shape, triangle)) expected.push_back(triangle.number);
    });
    TriangleSearch<Shape> search(tree, shape);
    while (!search.over()) {
      uint32_t numbers[64];
      const size_t count = search.next(numbers, 64);
      found.insert(found.end(), numbers, numbers + count);
      tests_ += search.tests();
      exact_tests_ += search.exact_tests();
    }
    EXPECT_EQ(found, expected) << described(shape);
  }

  // Returns the share of the tested triangles for which the predicates were called.
  double exact_share() const { return static_cast<double>(exact_tests_) / static_cast<double>(tests_); }

 private:
  uint64_t tests_ = 0, exact_tests_ = 0;
};

TEST_P(RegionKernelsTest, FindTheSameAsThePredicatesInRandomRegions) {
  compare(bumpy_sphere(14, 0.1, 1), scaled_count(1'500), 1);
  EXPECT_LT(exact_share(), 0.03);  // although half of the regions only touch a triangle
}

TEST_P(RegionKernelsTest, FindTheSameAsThePredicatesOnALattice) {
  const std::vector<Triangle> city = box_city(4, 1);
  compare(city, scaled_count(800), 2);
  const absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(city);
  ASSERT_TRUE(tree.ok());
  Random random(3);
  for (size_t i = 0; i < scaled_count(1'500) && !HasFailure(); ++i) {
    const auto half_units = [&](int low, int high) { return static_cast<float>(random.whole(low, high)) * 0.5f; };
    const Vec3f center = {half_units(-4, 80), half_units(-4, 80), half_units(-4, 44)};
    compare_one(*tree, Ballf{center, half_units(0, 20)});
    compare_one(*tree, Obbf{center, {half_units(0, 20), half_units(0, 20), half_units(0, 20)}, {}});
  }
}

TEST_P(RegionKernelsTest, FindTheSameAsThePredicatesInTinyHugeAndFarMeshes) {
  const std::vector<Triangle> sphere = bumpy_sphere(8, 0.1, 1);
  for (const float scale : {0x1p-60f, 0x1p-40f, 0x1p-20f, 1e-3f, 1e6f, 0x1p22f})
    compare(moved(sphere, scale, {}), scaled_count(150), 4);
  for (const float distance : {1e3f, 1e5f, 1e7f})
    compare(moved(sphere, 1, {distance, -2 * distance, distance / 2}), scaled_count(150), 5);
}

TEST_P(RegionKernelsTest, FindTheSameAsThePredicatesAmongSliversAndTrianglesWithoutArea) {
  Random random(6);
  std::vector<Triangle> slivers;
  for (int i = 0; i < 400; ++i) {
    const Vec3f a = random.float_vector(1), along = random.float_vector(random.chance(0.2) ? 1e-3 : 1);
    const Vec3f off = random.float_vector(random.magnitude(-40, -4));
    slivers.push_back({a, a + along, a + along * 0.5f + (random.chance(0.1) ? Vec3f{} : off)});
    if (random.chance(0.1)) slivers.back() = {a, a, a};
  }
  number_in_order(slivers);
  compare(slivers, scaled_count(1'000), 7);
}

// Tests balls whose centres are on or above a triangle. The triangle is so narrow that all three of its edges are near
// the projection of the centre on the triangle's plane.
TEST_P(RegionKernelsTest, FindTheSameAsThePredicatesForBallsBesideNarrowTriangles) {
  Random random(12);
  for (size_t i = 0; i < scaled_count(20'000) && !HasFailure(); ++i) {
    const Vec3d a = random.vector(1), along = random.vector(1), aside = random.unit_vector();
    const double width = random.magnitude(-16, -4);
    const Triangle narrow{to_float(a), to_float(a + along), to_float(a + along * random.unit() + aside * width), 0};
    const absl::StatusOr<TriangleBvh> tree = TriangleBvh::build({&narrow, 1});
    ASSERT_TRUE(tree.ok());
    const Vec3d beside = a + along * random.unit() + aside * (width * random.between(-0.01, 0.01));
    const Vec3d above = normalized(cross(along, aside)) * (random.chance(0.3) ? 0 : random.magnitude(-24, -2));
    Ballf ball{to_float(beside + above), 0};
    const double distance = std::sqrt(squared_distance(to_double(ball.center), narrow));
    ball.radius =
        static_cast<float>(distance * random.pick(std::vector<double>{1, 1, 1 - 0x1p-20, 1 + 0x1p-20, 1 - 0x1p-10}));
    compare_one(*tree, ball);
  }
}

// Some coordinates are nearly zero, like rounded results of sine and cosine, so that products of coordinates underflow.
TEST_P(RegionKernelsTest, FindTheSameAsThePredicatesAmongNearlyFlatTriangles) {
  Random random(8);
  std::vector<Triangle> flat;
  for (int i = 0; i < 300; ++i) {
    Triangle triangle{random.float_vector(1), random.float_vector(1), random.float_vector(1)};
    const int axis = random.whole(0, 2), other = random.whole(0, 2);
    for (Vec3f* vertex : {&triangle.a, &triangle.b, &triangle.c}) {
      (*vertex)[axis] = static_cast<float>(random.magnitude(-148, -40));
      if (random.chance(0.3)) (*vertex)[other] = static_cast<float>(random.magnitude(-148, -100));
    }
    flat.push_back(triangle);
  }
  number_in_order(flat);
  compare(flat, scaled_count(1'000), 9);
}

// The blocks of the tree contain both small and large triangles. For a small triangle, the kernel's error bound, which
// depends on the block's extent, is much larger than a bound that depends on the triangle's own size.
TEST_P(RegionKernelsTest, FindTheSameAsThePredicatesAmongTrianglesOfManySizes) {
  Random random(10);
  std::vector<Triangle> mixed;
  for (int i = 0; i < 600; ++i) {
    const Vec3f a = random.float_vector(1);
    const double size = random.magnitude(-12, 1);
    mixed.push_back({a, a + random.float_vector(size), a + random.float_vector(size)});
  }
  number_in_order(mixed);
  compare(mixed, scaled_count(1'000), 11);
  EXPECT_LT(exact_share(), 0.05);
}

TEST_P(RegionKernelsTest, TrianglesInsideTheRegionAreNotTested) {
  const absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(bumpy_sphere(14, 0.1, 1));
  ASSERT_TRUE(tree.ok());
  std::vector<uint32_t> numbers(tree->size() + kMinRegionRoom);
  TriangleSearch<Ballf> search(*tree, Ballf{{0, 0, 0}, 4});
  EXPECT_EQ(search.next(numbers.data(), numbers.size()), tree->size());
  EXPECT_TRUE(search.over());
  EXPECT_EQ(search.tests(), 0u);
  EXPECT_EQ(search.nodes(), 1u);
}

TEST_P(RegionKernelsTest, ACallPausesAfterTheMaximumNumberOfTests) {
  std::vector<Triangle> pile;
  for (uint32_t i = 0; i < 3 * kMaxRegionTests; ++i) {
    const float x = static_cast<float>(i) * 1e-6f;
    pile.push_back({{x, -1, -1}, {x, 1, -1}, {x, -1, 1}, i});
  }
  const absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(pile);
  ASSERT_TRUE(tree.ok());
  TriangleSearch<Ballf> search(*tree, Ballf{{0, 0, 0}, 0.5f});
  std::vector<uint32_t> numbers(tree->size() + kMinRegionRoom);
  search.next(numbers.data(), numbers.size());
  EXPECT_FALSE(search.over());
  EXPECT_GE(search.tests(), kMaxRegionTests);
  EXPECT_LT(search.tests(), kMaxRegionTests + 8);
}

// Batch of kMaxRegions balls, the most that one call of many() answers. The first ball overlaps no triangle, and each
// further ball is larger. `alone` contains the triangle numbers that a separate search finds for each ball.
struct Together {
  explicit Together(const TriangleBvh& tree) {
    for (size_t i = 0; i < kMaxRegions; ++i) {
      shapes[i] = {{0, 0, static_cast<float>(i) * 0.1f}, 0.15f * static_cast<float>(i)};
      balls[i] = kernel_region(shapes[i]);
      predicates[i] = predicate_of(shapes[i]);
      TriangleSearch<Ballf> search(tree, shapes[i]);
      while (!search.over()) {
        uint32_t found[64];
        const size_t count = search.next(found, 64);
        alone.insert(alone.end(), found, found + count);
      }
      ends.push_back(alone.size());
    }
  }

  size_t answered(const TriangleBvh& tree, size_t room) {
    numbers.assign(room, 0);
    return active_region_kernels()->ball.many(tree.tree(), balls, predicates, kMaxRegions, numbers.data(), room,
                                              counts);
  }

  Ballf shapes[kMaxRegions];
  KernelBall balls[kMaxRegions];
  RegionPredicate predicates[kMaxRegions];
  uint32_t counts[kMaxRegions];
  std::vector<uint32_t> numbers, alone;
  std::vector<size_t> ends;  // end of each ball's numbers in `alone`
};

TEST_P(RegionKernelsTest, RegionsAnsweredTogetherFindTheSameAsAlone) {
  const absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(bumpy_sphere(40, 0.1, 1));
  ASSERT_TRUE(tree.ok());
  Together together(*tree);
  ASSERT_EQ(together.answered(*tree, together.alone.size() + kMinRegionRoom), kMaxRegions);
  size_t end = 0;
  for (size_t i = 0; i < kMaxRegions; ++i) EXPECT_EQ(end += together.counts[i], together.ends[i]) << i;
  together.numbers.resize(end);
  EXPECT_EQ(together.numbers, together.alone);
}

TEST_P(RegionKernelsTest, RegionsWithoutRoomForTheirNumbersAreNotAnswered) {
  const absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(bumpy_sphere(14, 0.1, 1));
  ASSERT_TRUE(tree.ok());
  Together together(*tree);
  for (size_t room = 0; room < together.alone.size() + kMinRegionRoom; room += 97) {
    const size_t answered = together.answered(*tree, room);
    ASSERT_LT(answered, kMaxRegions);
    size_t end = 0;
    for (size_t i = 0; i < answered; ++i) EXPECT_EQ(end += together.counts[i], together.ends[i]) << i;
    // The triangle numbers of the answered regions fit into `room` entries. The next region is not answered, because
    // fewer than kMinRegionRoom entries would be free after its numbers. A kernel needs kMinRegionRoom free entries,
    // because it may write beyond the last number.
    EXPECT_LE(end, room);
    EXPECT_LT(room, together.ends[answered] + kMinRegionRoom);
  }
}

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(RegionKernelsTest);
INSTANTIATE_TEST_SUITE_P(InstructionSets, RegionKernelsTest, ::testing::ValuesIn(sets_with_vector_kernels()),
                         [](const auto& instance) { return instance.param; });

}  // namespace
}  // namespace locus::test
