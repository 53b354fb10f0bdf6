// Every instruction set's kernels against all triangles one by one, bit for bit.
#include "core/index/bvh/kernels/ray_kernels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/geometry/ray_triangle.h"
#include "core/index/bvh/kernels/dispatch.h"
#include "core/index/bvh/triangle_bvh.h"
#include "tests/support/generated_meshes.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Question {
  Vec3d origin, direction;
  float limit = kInfinity;
  Cull cull = Cull::kNone;
};

struct Answer {
  float t;
  uint32_t number;
};

std::optional<Answer> by_all_triangles(const std::vector<Triangle>& triangles, const Question& question) {
  const TriangleRay ray(question.origin, question.direction, question.cull);
  std::optional<Answer> best;
  for (const Triangle& triangle : triangles) {
    const std::optional<TriangleHit> found = ray.hit(triangle);
    if (!found) continue;
    const float t = ray.from_scaled(found->t);
    if (!(t <= question.limit)) continue;
    if (!best || t < best->t || (t == best->t && triangle.number < best->number)) best = Answer{t, triangle.number};
  }
  return best;
}

KernelRay kernel_ray(const Question& question) {
  return {{question.origin.x, question.origin.y, question.origin.z},
          {question.direction.x, question.direction.y, question.direction.z},
          question.limit,
          question.cull != Cull::kFront,
          question.cull != Cull::kBack};
}

class RayKernelsTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    ASSERT_TRUE(use_instruction_set(GetParam()).ok());
    kernels_ = active_ray_kernels();
    ASSERT_NE(kernels_, nullptr);
  }
  void TearDown() override { ASSERT_TRUE(use_instruction_set("").ok()); }

  // Compares what is decided, with and without a limit at, just before and just behind the hit.
  void judge(const std::vector<Triangle>& triangles, const std::vector<Question>& questions) {
    const absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(triangles);
    ASSERT_TRUE(tree.ok()) << tree.status();
    for (size_t i = 0; i < questions.size(); ++i) {
      SCOPED_TRACE(testing::Message() << "question " << i);
      const std::optional<Answer> best = by_all_triangles(triangles, questions[i]);
      judge_one(*tree, questions[i], best);
      if (!best) continue;
      Question limited = questions[i];
      limited.limit = best->t;
      judge_one(*tree, limited, best);
      limited.limit = std::nextafter(best->t, kInfinity);
      judge_one(*tree, limited, best);
      limited.limit = std::nextafter(best->t, -kInfinity);
      if (limited.limit >= 0) judge_one(*tree, limited, std::nullopt);
      if (HasFailure()) return;
    }
  }

  double undecided_share() const { return static_cast<double>(undecided_) / static_cast<double>(asked_); }

 private:
  void judge_one(const TriangleBvh& tree, const Question& question, const std::optional<Answer>& expected) {
    const KernelRay ray = kernel_ray(question);
    KernelHit first{}, any{};
    kernels_->first(tree.tree(), &ray, &first, 1);
    kernels_->any(tree.tree(), &ray, &any, 1);
    for (const KernelHit* hit : {&first, &any}) {
      ++asked_;
      if (hit->verdict == KernelVerdict::kUndecided)
        ++undecided_;
      else
        EXPECT_EQ(hit->verdict == KernelVerdict::kHit, expected.has_value()) << (hit == &first ? "first" : "any");
    }
    if (first.verdict != KernelVerdict::kHit || !expected) return;
    EXPECT_EQ(first.t, expected->t);
    EXPECT_EQ(std::signbit(first.t), std::signbit(expected->t));
    EXPECT_EQ(first.number, expected->number);
  }

  const RayKernels* kernels_ = nullptr;
  uint64_t asked_ = 0, undecided_ = 0;
};

// Half of them short, a third of them culling.
std::vector<Question> random_questions(const Aabbf& bounds, size_t count, uint64_t seed) {
  Random random(seed);
  const double size = double{max_component(bounds.extent())};
  std::vector<Question> questions;
  for (size_t i = 0; i < count; ++i) {
    Question question;
    for (int axis = 0; axis < 3; ++axis)
      question.origin[axis] = random.between(bounds.min[axis] - 0.1 * size, bounds.max[axis] + 0.1 * size);
    question.direction = random.unit_vector() * random.magnitude(-19, 19);
    if (random.chance(0.5))
      question.limit = static_cast<float>(0.2 * size / std::sqrt(squared_length(question.direction)));
    if (random.chance(0.3)) question.cull = random.chance(0.5) ? Cull::kBack : Cull::kFront;
    questions.push_back(question);
  }
  return questions;
}

Aabbf bounds_of_all(const std::vector<Triangle>& triangles) {
  Aabbf bounds;
  for (const Triangle& triangle : triangles) bounds = merge(bounds, bounds_of(triangle));
  return bounds;
}

std::vector<Triangle> moved(std::vector<Triangle> triangles, float scale, Vec3f by) {
  for (Triangle& triangle : triangles)
    for (Vec3f* vertex : {&triangle.a, &triangle.b, &triangle.c}) *vertex = *vertex * scale + by;
  return triangles;
}

TEST_P(RayKernelsTest, DecideRandomRaysAsAllTrianglesDo) {
  for (const std::vector<Triangle>& mesh : {bumpy_sphere(14, 0.1, 1), box_city(6, 1), box_city(1, 2)}) {
    judge(mesh, random_questions(bounds_of_all(mesh), scaled_count(4'000), 1));
    ASSERT_FALSE(HasFailure());
  }
  EXPECT_LT(undecided_share(), 0.001);
}

TEST_P(RayKernelsTest, DecideTinyHugeAndFarMeshesAsAllTrianglesDo) {
  const std::vector<Triangle> sphere = bumpy_sphere(10, 0.1, 1);
  for (const float scale : {0x1p-23f, 0x1p-20f, 1e-3f, 1e6f, 0x1p30f}) {
    const std::vector<Triangle> mesh = moved(sphere, scale, {});
    judge(mesh, random_questions(bounds_of_all(mesh), scaled_count(2'000), 2));
    ASSERT_FALSE(HasFailure());
  }
  EXPECT_LT(undecided_share(), 0.001);
  // Here float knows little, and double decides.
  for (const float distance : {1e3f, 1e5f, 1e7f}) {
    const std::vector<Triangle> mesh = moved(sphere, 1, {distance, -2 * distance, distance / 2});
    judge(mesh, random_questions(bounds_of_all(mesh), scaled_count(2'000), 3));
    ASSERT_FALSE(HasFailure());
  }
}

// Rays along axes and diagonals from corners, edges and walls, where many triangles are edge-on or equally near.
TEST_P(RayKernelsTest, DecideRaysOfALatticeAsAllTrianglesDo) {
  const std::vector<Triangle> city = box_city(5, 1);
  Random random(4);
  std::vector<Question> questions;
  while (questions.size() < scaled_count(6'000)) {
    Question question;
    question.origin =
        Vec3d{double(random.whole(-2, 100)), double(random.whole(-2, 100)), double(random.whole(-2, 44))} * 0.5;
    question.direction = random.whole_vector(1);
    if (question.direction == Vec3d{}) continue;
    questions.push_back(question);
  }
  judge(city, questions);
}

// Only double can tell the components apart. From just off the surface, the axis chosen to project along shows in t.
TEST_P(RayKernelsTest, DecideNearDiagonalsAsAllTrianglesDo) {
  const std::vector<Triangle> sphere = bumpy_sphere(14, 0.1, 1);
  Random random(9);
  std::vector<Question> questions;
  while (questions.size() < scaled_count(4'000)) {
    const Triangle& triangle = random.pick(sphere);
    const double u = random.unit(), v = random.unit() * (1 - u);
    Question question;
    question.direction = random.whole_vector(1);
    if (question.direction == Vec3d{}) continue;
    for (int axis = 0; axis < 3; ++axis) question.direction[axis] *= 1 + random.between(-1, 1) * 0x1p-26;
    question.origin = to_double(triangle.a) * (1 - u - v) + to_double(triangle.b) * u + to_double(triangle.c) * v -
                      question.direction * random.magnitude(-40, -20);
    questions.push_back(question);
  }
  judge(sphere, questions);
}

TEST_P(RayKernelsTest, DecideRaysAimedAtVerticesAndEdgesAsAllTrianglesDo) {
  const std::vector<Triangle> sphere = bumpy_sphere(14, 0.1, 1);
  Random random(5);
  std::vector<Question> questions;
  for (size_t i = 0; i < scaled_count(6'000); ++i) {
    const Triangle& triangle = random.pick(sphere);
    const double along = random.chance(0.3) ? 0 : random.unit();
    const Vec3d target = to_double(triangle.a) * (1 - along) + to_double(triangle.b) * along;
    Question question;
    question.origin = random.vector(0.3);
    question.direction = target - question.origin;
    questions.push_back(question);
  }
  judge(sphere, questions);
  EXPECT_LT(undecided_share(), 0.001);
}

TEST_P(RayKernelsTest, DecideRaysFromTheSurfaceAsAllTrianglesDo) {
  const std::vector<Triangle> sphere = bumpy_sphere(14, 0.1, 1);
  Random random(6);
  std::vector<Question> questions;
  for (size_t i = 0; i < scaled_count(4'000); ++i) {
    const Triangle& triangle = random.pick(sphere);
    const double u = random.unit(), v = random.unit() * (1 - u);
    Question question;
    question.origin = to_double(triangle.a) * (1 - u - v) + to_double(triangle.b) * u + to_double(triangle.c) * v;
    question.direction = random.unit_vector();
    questions.push_back(question);
  }
  judge(sphere, questions);
}

TEST_P(RayKernelsTest, DecideSliversAndTrianglesWithoutAreaAsAllTrianglesDo) {
  Random random(7);
  std::vector<Triangle> slivers;
  for (int i = 0; i < 300; ++i) {
    const Vec3f a = random.float_vector(1), along = random.float_vector(1);
    const Vec3f off = random.float_vector(random.magnitude(-40, -4));
    slivers.push_back({a, a + along, a + along * 0.5f + (random.chance(0.1) ? Vec3f{} : off)});
  }
  number_in_order(slivers);
  std::vector<Question> questions;
  for (size_t i = 0; i < scaled_count(6'000); ++i) {
    const Triangle& triangle = random.pick(slivers);
    Question question;
    question.origin = random.vector(2);
    question.direction = to_double(triangle.a) * 0.5 + to_double(triangle.b) * 0.5 - question.origin;
    if (random.chance(0.2)) question.direction = to_double(triangle.b) - to_double(triangle.a);
    questions.push_back(question);
  }
  judge(slivers, questions);
}

TEST_P(RayKernelsTest, OfEqualHitsTheLowestNumberWins) {
  std::vector<Triangle> copies;
  for (int copy = 0; copy < 5; ++copy)
    for (const Triangle& triangle : bumpy_sphere(6, 0.1, 1)) copies.push_back(triangle);
  number_in_order(copies);
  Random random(8);
  random.shuffle(copies);
  judge(copies, random_questions(bounds_of_all(copies), scaled_count(1'000), 8));
}

// The bound of a call: a pile of triangles that all lie on the ray's way and are all missed.
TEST_P(RayKernelsTest, ARayThatMeetsTooManyTrianglesIsLeftUndecided) {
  std::vector<Triangle> pile;
  for (uint32_t i = 0; i < 3 * kMaxKernelTests; ++i) {
    const float x = static_cast<float>(i);
    pile.push_back({{x, -1, -1}, {x, 1, -1}, {x, -1, 1}, i});
  }
  const absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(pile);
  ASSERT_TRUE(tree.ok());
  const KernelRay ray = kernel_ray({{-1, 0.9, 0.9}, {1, 0, 0}});
  KernelHit hit{};
  active_ray_kernels()->first(tree->tree(), &ray, &hit, 1);
  EXPECT_EQ(hit.verdict, KernelVerdict::kUndecided);
  EXPECT_GT(hit.tests, kMaxKernelTests);
  EXPECT_LT(hit.tests, kMaxKernelTests + 9);
}

std::vector<std::string> with_kernels() {
  std::vector<std::string> names = instruction_sets();
  names.pop_back();
  return names;
}

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(RayKernelsTest);
INSTANTIATE_TEST_SUITE_P(InstructionSets, RayKernelsTest, ::testing::ValuesIn(with_kernels()),
                         [](const auto& instance) { return instance.param; });

}  // namespace
}  // namespace locus::test
