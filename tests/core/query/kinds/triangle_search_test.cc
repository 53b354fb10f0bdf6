#include "core/query/kinds/triangle_search.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/generated_meshes.h"

namespace locus::test {
namespace {

std::vector<Ballf> some_balls(size_t count) {
  Random random(1);
  std::vector<Ballf> balls;
  while (balls.size() < count) balls.push_back({random.float_vector(1), static_cast<float>(random.magnitude(-7, 1))});
  return balls;
}

std::vector<Obbf> some_boxes(size_t count) {
  Random random(2);
  std::vector<Obbf> boxes;
  while (boxes.size() < count) {
    const Vec3d half = {random.magnitude(-7, 1), random.magnitude(-7, 1), random.magnitude(-7, 1)};
    boxes.push_back({random.float_vector(1), to_float(half), {}});
    if (random.chance(0.3)) boxes.back().rotation = rotation_of(random.rotation());
  }
  return boxes;
}

class TriangleSearchTest : public ::testing::Test {
 protected:
  void SetUp() override {
    absl::StatusOr<TriangleBvh> built = TriangleBvh::build(bumpy_sphere(128, 0.1, 1));
    ASSERT_TRUE(built.ok());
    tree_ = *std::move(built);
  }
  void TearDown() override { ASSERT_TRUE(use_instruction_set("").ok()); }

  template <class Shape, class Meets>
  void judge(const std::vector<Shape>& shapes, Meets meets) {
    std::vector<uint32_t> counts(shapes.size()), numbers(shapes.size() * tree_.size());
    ASSERT_EQ(find_triangles(tree_, shapes, absl::MakeSpan(counts), absl::MakeSpan(numbers)), shapes.size());
    size_t behind = 0;
    for (size_t i = 0; i < shapes.size(); ++i) {
      std::vector<uint32_t> expected;
      tree_.for_each([&](const Triangle& triangle) {
        if (meets(shapes[i], triangle)) expected.push_back(triangle.number);
      });
      const auto first = numbers.begin() + static_cast<std::ptrdiff_t>(behind);
      ASSERT_EQ(std::vector<uint32_t>(first, first + counts[i]), expected) << "region " << i;
      behind += counts[i];
    }
  }

  TriangleBvh tree_;
};

TEST_F(TriangleSearchTest, BatchesFindWhatThePredicatesFindInStorageOrderWithAndWithoutKernels) {
  ASSERT_GT(tree_.bytes(), size_t{2} << 20);  // larger than 2 MiB, so that the kernels interleave searches
  for (const std::string& name : instruction_sets()) {
    SCOPED_TRACE(name);
    ASSERT_TRUE(use_instruction_set(name).ok());
    judge(some_balls(61), [](const Ballf& ball, const Triangle& triangle) { return ball_overlaps(ball, triangle); });
    judge(some_boxes(61), [](const Obbf& box, const Triangle& triangle) { return box_overlaps(box, triangle); });
  }
}

TEST_F(TriangleSearchTest, ABatchEndsBeforeTheRegionThatDoesNotFit) {
  const std::vector<Ballf> balls(20, Ballf{{0, 0, 0}, 4});
  for (const std::string& name : instruction_sets()) {
    SCOPED_TRACE(name);
    ASSERT_TRUE(use_instruction_set(name).ok());
    std::vector<uint32_t> counts(balls.size()), numbers(3 * tree_.size() + kMinRegionRoom);
    EXPECT_EQ(find_triangles(tree_, balls, absl::MakeSpan(counts), absl::MakeSpan(numbers)), 3u);
    EXPECT_EQ(counts[2], tree_.size());
  }
}

TEST_F(TriangleSearchTest, KernelsAreNotUsedForRegionsBeyondTheirMaximumExtent) {
  EXPECT_FALSE(TriangleSearch<Ballf>::served(tree_, Ballf{{1e9f, 0, 0}, 1}));
  EXPECT_FALSE(TriangleSearch<Obbf>::served(tree_, Obbf{{0, 0, 0}, {1e9f, 0, 0}, {}}));
  EXPECT_FALSE(TriangleSearch<Ballf>::served(TriangleBvh(), Ballf{{0, 0, 0}, 1}));
  const std::vector<Ballf> balls = {{{1e9f, 0, 0}, 2e9f}};
  std::vector<uint32_t> counts(1), numbers(tree_.size() + kMinRegionRoom);
  EXPECT_EQ(find_triangles(tree_, balls, absl::MakeSpan(counts), absl::MakeSpan(numbers)), 1u);
  EXPECT_EQ(counts[0], tree_.size());
}

}  // namespace
}  // namespace locus::test
