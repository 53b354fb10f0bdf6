// Properties of a TriangleBvh build other than correct answers: equal trees on any number of threads, cancellation, and
// trees of low cost. The cost is tested separately, because a badly split tree still answers correctly.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <unordered_set>

#include "core/base/refusal.h"
#include "core/geometry/ray_triangle.h"
#include "core/index/bvh/triangle_bvh.h"
#include "core/index/queries/index_queries.h"
#include "tests/support/equal_trees.h"
#include "tests/support/generated_meshes.h"
#include "tests/support/test_scale.h"
#include "tests/support/threads.h"

namespace locus::test {
namespace {

TriangleBvh build_mesh(const std::vector<Triangle>& triangles, const BvhOptions& options = {}) {
  absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(triangles, options);
  EXPECT_TRUE(tree.ok()) << tree.status();
  return tree.ok() ? *std::move(tree) : TriangleBvh();
}

// Returns a mesh that is so large that its build is divided into many tasks.
std::vector<Triangle> large_mesh() { return bumpy_sphere(130, 0.05, 6); }

TEST(TriangleBvhBuildTest, AnyNumberOfThreadsGivesTheSameBytes) {
  const std::vector<Triangle> triangles = large_mesh();
  const TriangleBvh alone = build_mesh(triangles);
  for (const size_t threads : {1, 2, 3, 8}) {
    SCOPED_TRACE(threads);
    BvhOptions options;
    options.parallel_for = on_threads(threads);
    expect_equal_bytes(build_mesh(triangles, options), alone);
  }
  BvhOptions options;
  options.parallel_for = backwards();
  expect_equal_bytes(build_mesh(triangles, options), alone);
}

TEST(TriangleBvhBuildTest, CoincidentTrianglesGiveTheSameBytesOnAnyThreadsToo) {
  std::vector<Triangle> triangles(20'000, Triangle{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  number_in_order(triangles);
  BvhOptions options;
  options.parallel_for = on_threads(3);
  expect_equal_bytes(build_mesh(triangles, options), build_mesh(triangles));
}

// The first build is not cancelled and counts its tasks. Each further build is cancelled at one task (the 7th, the
// 14th, and so on) and must return CANCELLED.
TEST(TriangleBvhBuildTest, ABuildCancelledAnywhereEndsWithCancelled) {
  const std::vector<Triangle> triangles = large_mesh();
  size_t tasks = 0;
  for (size_t cancelled_task = 0; cancelled_task <= tasks; cancelled_task += 7) {
    std::atomic<bool> cancel = false;
    size_t done = 0;
    BvhOptions options;
    options.cancel = &cancel;
    options.parallel_for = [&](size_t count, const std::function<void(size_t)>& work) {
      for (size_t i = 0; i < count; ++i) {
        if (cancelled_task != 0 && ++done == cancelled_task) cancel = true;
        if (cancelled_task == 0) ++tasks;
        work(i);
      }
    };
    const absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(triangles, options);
    EXPECT_EQ(tree.status().code(), cancelled_task == 0 ? absl::StatusCode::kOk : absl::StatusCode::kCancelled)
        << cancelled_task;
  }
  EXPECT_GT(tasks, 30u);
}

TEST(TriangleBvhBuildTest, TheFirstTriangleThatIsNotFiniteIsNamedByAnyThreads) {
  std::vector<Triangle> triangles = large_mesh();
  triangles[60'000].c.z = triangles[20'001].a.x = std::numeric_limits<float>::quiet_NaN();
  BvhOptions options;
  for (const ParallelFor& parallel_for : {on_threads(3), backwards()}) {
    options.parallel_for = parallel_for;
    const absl::Status status = TriangleBvh::build(triangles, options).status();
    ASSERT_TRUE(refusal_of(status).has_value());
    EXPECT_EQ(refusal_of(status)->index, 20'001u);
  }
}

// A large triangle is, for example, the ground below houses. If its block also contained small triangles, every ray
// that hits the ground would also test the small triangles.
TEST(TriangleBvhBuildTest, ALargeTriangleGetsABlockOfItsOwn) {
  std::vector<Triangle> triangles;
  for (int i = 0; i < 15; ++i) {
    const auto x = static_cast<float>(i);
    triangles.push_back({{x, 0, 0}, {x + 0.5f, 0, 0}, {x, 0.5f, 0}});
  }
  triangles.push_back({{-900, -1000, 0}, {1100, -1000, 0}, {100, 1000, 0}});
  number_in_order(triangles);
  const TriangleBvh built = build_mesh(triangles);
  ASSERT_EQ(built.block_count(), 3u);
  const TriangleTree tree = built.tree();
  for (size_t block = 0; block < 3; ++block)
    EXPECT_EQ(tree.blocks[block].count == 1, tree.numbers[tree.blocks[block].first] == 15);
}

// Visitor that searches for the first hit and counts the blocks that it visits. It counts a block when it visits the
// first triangle of the block.
class CountingRay {
 public:
  CountingRay(const TriangleRay& ray, const std::unordered_set<uint32_t>& first_of_block, size_t& blocks)
      : ray_(ray), first_of_block_(first_of_block), blocks_(blocks) {}

  float limit() const { return limit_; }
  bool visit(const Triangle& triangle) {
    blocks_ += first_of_block_.count(triangle.number);
    if (const std::optional<TriangleHit> hit = ray_.hit(triangle)) limit_ = std::min(limit_, hit->t);
    return true;
  }

 private:
  const TriangleRay& ray_;
  const std::unordered_set<uint32_t>& first_of_block_;
  size_t& blocks_;
  float limit_ = std::numeric_limits<float>::infinity();
};

struct TreeCost {
  double sah, nodes, blocks, bytes;  // `nodes` and `blocks` are means per ray, `bytes` is a mean per triangle
};

// Returns the cost of a tree: its SAH cost, its size, and the mean work of finding the first hits of incoherent rays
// that start within the tree's bounds.
TreeCost cost_of(const std::vector<Triangle>& triangles, const BvhOptions& options = {}) {
  const TriangleBvh tree = build_mesh(triangles, options);
  std::unordered_set<uint32_t> first_of_block;
  for (size_t block = 0; block < tree.block_count(); ++block)
    first_of_block.insert(tree.tree().numbers[tree.tree().blocks[block].first]);
  constexpr int kRays = 2'000;
  Random random(17);
  Work work;
  size_t blocks = 0;
  for (int i = 0; i < kRays; ++i) {
    Vec3d origin;
    for (int axis = 0; axis < 3; ++axis)
      origin[axis] = random.between(tree.bounds().min[axis], tree.bounds().max[axis]);
    const TriangleRay ray(origin, random.unit_vector());
    CountingRay visitor(ray, first_of_block, blocks);
    tree.visit_ray(ray.slabs(), visitor, work);
  }
  return {tree.sah_cost(), static_cast<double>(work.nodes) / kRays, static_cast<double>(blocks) / kRays,
          static_cast<double>(tree.bytes()) / static_cast<double>(triangles.size())};
}

void expect_below(const TreeCost& cost, const TreeCost& ceiling) {
  EXPECT_LT(cost.sah, ceiling.sah);
  EXPECT_LT(cost.nodes, ceiling.nodes);
  EXPECT_LT(cost.blocks, ceiling.blocks);
  EXPECT_LT(cost.bytes, ceiling.bytes);
}

// The ceilings, the expected maxima of cost_of(), are 4 % above the costs of the current builder.
TEST(TriangleBvhBuildTest, ASphereStaysBelowItsCeilings) {
  expect_below(cost_of(bumpy_sphere(64, 0.02, 1)), {11.3, 5.2, 1.46, 56});
}

TEST(TriangleBvhBuildTest, ANoisySphereStaysBelowItsCeilings) {
  expect_below(cost_of(bumpy_sphere(130, 0.2, 3)), {57.1, 8.9, 6.64, 56});
}

TEST(TriangleBvhBuildTest, ACityStaysBelowItsCeilings) {
  expect_below(cost_of(box_city(32, 1)), {11.5, 4.48, 1.38, 68});
}

}  // namespace
}  // namespace locus::test
