// What is restored from an outline: the very tree that was built where it is its own, and from any other one a tree
// that answers as right.
#include "core/index/bvh/tree_topology.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <numeric>

#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/index/bvh/kernels/dispatch.h"
#include "core/index/bvh/triangle_bvh.h"
#include "tests/support/equal_trees.h"
#include "tests/support/generated_meshes.h"
#include "tests/support/kernel_trials.h"
#include "tests/support/random_topology.h"
#include "tests/support/region_trials.h"
#include "tests/support/scene_search.h"
#include "tests/support/threads.h"

namespace locus::test {
namespace {

std::vector<Triangle> renumbered(std::vector<Triangle> triangles) {
  number_in_order(triangles);
  return triangles;
}

// With `triangles` in the order of their numbers.
absl::StatusOr<TriangleBvh> restore(const TreeTopology& topology, const std::vector<Triangle>& triangles,
                                    const BvhOptions& options = {}) {
  const auto triangle = [&](uint32_t number) { return triangles[number]; };
  return TriangleBvh::restore(topology, static_cast<uint32_t>(triangles.size()), triangle, options);
}

TEST(TreeTopologyTest, ATreeComesBackByteForByteOnAnyThreads) {
  for (const std::vector<Triangle>& triangles : {bumpy_sphere(130, 0.05, 6), box_city(9, 1), bumpy_sphere(2, 0.1, 1)}) {
    const TriangleBvh built = *TriangleBvh::build(triangles);
    for (const ParallelFor& parallel_for : {on_threads(1), on_threads(3), backwards()}) {
      BvhOptions options;
      options.parallel_for = parallel_for;
      const absl::StatusOr<TriangleBvh> restored = restore(built.topology(), triangles, options);
      ASSERT_TRUE(restored.ok()) << restored.status();
      expect_equal_bytes(*restored, built);
    }
  }
}

TEST(TreeTopologyTest, ATreeOfEverySmallSizeComesBack) {
  const std::vector<Triangle> all = bumpy_sphere(6, 0.1, 2);
  for (size_t count = 1; count <= all.size(); ++count) {
    const std::vector<Triangle> some(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count));
    const TriangleBvh built = *TriangleBvh::build(some);
    const absl::StatusOr<TriangleBvh> restored = restore(built.topology(), some);
    ASSERT_TRUE(restored.ok()) << restored.status();
    expect_equal_bytes(*restored, built);
  }
}

// The promise that makes it safe to keep them.
std::string difference_of_any_outline(const TestScene<Triangle>& scene) {
  if (scene.values.empty()) return "";
  TestScene<Triangle> numbered = scene;
  numbered.values = renumbered(scene.values);
  Random random(scene.values.size());
  const RandomOutline made(static_cast<uint32_t>(scene.values.size()), random);
  const absl::StatusOr<TriangleBvh> tree = restore(made.topology(), numbered.values);
  if (!tree.ok()) return tree.status().ToString();
  const ListIndex<Triangle> oracle = make_list(numbered.values);
  return IndexJudge<TriangleBvh>(*tree, oracle).difference(numbered);
}

TEST(TreeTopologyTest, AnyOutlineThatFitsAnswersAsTheListDoes) {
  EXPECT_EQ(search_all_scenes<Triangle>(scaled_count(1'000), scaled_count(300), difference_of_any_outline), "");
}

TEST(TreeTopologyTest, KernelsAnswerRightInATreeOfAnyOutline) {
  const std::vector<Triangle> triangles = bumpy_sphere(14, 0.1, 1);
  for (const std::string& name : instruction_sets()) {
    ASSERT_TRUE(use_instruction_set(name).ok());
    const RayKernels* const kernels = active_ray_kernels();
    const RegionKernels* const region_kernels = active_region_kernels();
    if (kernels == nullptr) continue;  // the portable way has none
    for (uint64_t seed = 0; seed < 4; ++seed) {
      Random random(seed);
      const RandomOutline made(static_cast<uint32_t>(triangles.size()), random);
      absl::StatusOr<TriangleBvh> tree = restore(made.topology(), triangles);
      ASSERT_TRUE(tree.ok()) << tree.status();
      const KernelTrial trial(absl::StrCat("outline ", seed), triangles,
                              random_questions(triangles, scaled_count(500), seed), *std::move(tree));
      EXPECT_EQ(trial.difference(*kernels), "") << name;
      tree = restore(made.topology(), triangles);
      const RegionTrial regions = random_region_trial("regions", triangles, *std::move(tree), scaled_count(100), seed);
      EXPECT_EQ(regions.difference(*region_kernels), "") << name;
    }
  }
  ASSERT_TRUE(use_instruction_set("").ok());
}

class WrongOutlineTest : public ::testing::Test {
 protected:
  WrongOutlineTest() : built_(*TriangleBvh::build(triangles_)), wrong_(built_.topology()) {
    numbers_.assign(wrong_.numbers.begin(), wrong_.numbers.end());
    wrong_.numbers = numbers_;
  }
  std::string refused() { return std::string(restore(wrong_, triangles_).status().message()); }

  const std::vector<Triangle> triangles_ = box_city(3, 1);
  const TriangleBvh built_;
  std::vector<uint32_t> numbers_;
  TreeTopology wrong_;
};

TEST_F(WrongOutlineTest, TheOneOfTheTreeFits) { EXPECT_EQ(refused(), ""); }

TEST_F(WrongOutlineTest, OneOfOtherTrianglesIsRefused) {
  numbers_[5] = numbers_[4];
  EXPECT_EQ(refused(), "the outline of the tree does not fit: a triangle is missing");
  numbers_[5] = static_cast<uint32_t>(numbers_.size());
  EXPECT_EQ(refused(), "the outline of the tree does not fit: a triangle is missing");
  wrong_.numbers.remove_suffix(1);
  EXPECT_EQ(refused(), "the outline of the tree does not fit: other triangles");
}

TEST_F(WrongOutlineTest, BlocksThatDoNotAddUpAreRefused) {
  const std::vector<uint8_t> sizes = wrong_.block_sizes;
  for (const int size : {0, 9, 255}) {
    wrong_.block_sizes[1] = static_cast<uint8_t>(size);
    EXPECT_EQ(refused(), "the outline of the tree does not fit: the size of a block");
  }
  wrong_.block_sizes = sizes;
  wrong_.block_sizes.pop_back();
  EXPECT_EQ(refused(), "the outline of the tree does not fit: blocks of other triangles");
}

TEST_F(WrongOutlineTest, NodesThatDoNotHoldTogetherAreRefused) {
  const std::vector<NodeOutline> nodes = wrong_.nodes;
  wrong_.nodes.clear();
  EXPECT_EQ(refused(), "the outline of the tree does not fit: nodes or blocks without triangles");
  wrong_.nodes = nodes;
  wrong_.nodes.pop_back();
  EXPECT_EQ(refused(), "the outline of the tree does not fit: nodes are missing");
  wrong_.nodes = nodes;
  wrong_.nodes.push_back({1, 0});
  EXPECT_EQ(refused(), "the outline of the tree does not fit: nodes too many");
  for (const NodeOutline children : {NodeOutline{0, 0}, NodeOutline{1, 1}, NodeOutline{2, 0}, NodeOutline{4, 1}}) {
    wrong_.nodes = nodes;
    wrong_.nodes.back() = children;
    EXPECT_EQ(refused(), "the outline of the tree does not fit: the children of a node");
  }
  wrong_.nodes = nodes;
  const auto has_room = [](const NodeOutline& node) { return node.nodes == 0 && node.blocks < 0x7F; };
  std::find_if(wrong_.nodes.rbegin(), wrong_.nodes.rend(), has_room)->blocks = 0xFF;
  EXPECT_EQ(refused(), "the outline of the tree does not fit: blocks are missing");
  wrong_.nodes = nodes;
  wrong_.nodes.back() = {1, 0};
  EXPECT_EQ(refused(), "the outline of the tree does not fit: blocks too many");
}

// A chain of nodes: each has as many blocks as it can beside the next, and all of them are spread over the mesh, so
// that who walks it finds everything near and has as much waiting as may ever wait.
class Chain {
 public:
  explicit Chain(uint32_t levels) : triangles_(bumpy_sphere(31, 0.1, 1)) {
    const uint32_t blocks = (levels - 1) * (kTreeWidth - 1) + kTreeWidth;
    LOCUS_CHECK_LE(blocks * kTreeWidth, triangles_.size());
    triangles_.resize(blocks * kTreeWidth);
    numbers_.resize(triangles_.size());
    std::iota(numbers_.begin(), numbers_.end(), 0);
    Random random(1);
    random.shuffle(numbers_);
    outline_.numbers = numbers_;
    outline_.block_sizes.assign(blocks, kTreeWidth);
    outline_.nodes.assign(levels - 1, NodeOutline{0x7F, 0x80});
    outline_.nodes.push_back({0xFF, 0});
  }
  Chain(const Chain&) = delete;
  Chain& operator=(const Chain&) = delete;

  const std::vector<Triangle>& triangles() const { return triangles_; }
  absl::StatusOr<TriangleBvh> tree() const { return restore(outline_, triangles_); }

 private:
  std::vector<Triangle> triangles_;
  std::vector<uint32_t> numbers_;
  TreeTopology outline_;
};

TEST(TreeTopologyTest, TheDeepestTreeThatIsLetInIsWalkedToItsEnd) {
  const Chain chain(limits::kMaxBvhDepth);
  absl::StatusOr<TriangleBvh> tree = chain.tree();
  ASSERT_TRUE(tree.ok()) << tree.status();
  EXPECT_EQ(tree->depth(), limits::kMaxBvhDepth);
  const ListIndex<Triangle> oracle = make_list(chain.triangles());
  const IndexJudge<TriangleBvh> judge(*tree, oracle);
  Random random(2);
  for (size_t i = 0; i < scaled_count(40); ++i) {
    const Vec3d direction = random.unit_vector();
    EXPECT_EQ(judge.ray_difference(TriangleRay({0, 0, 0}, direction), i), "");
    EXPECT_EQ(judge.point_difference(direction * random.unit()), "");
    EXPECT_EQ(judge.ball_difference({to_float(direction), random.float_between(0, 2)}), "");
  }
  const std::vector<KernelQuestion> questions = random_questions(chain.triangles(), scaled_count(300), 3);
  const KernelTrial trial("chain", chain.triangles(), questions, *std::move(tree));
  const RegionTrial regions = random_region_trial("chain", chain.triangles(), *chain.tree(), scaled_count(40), 4);
  for (const std::string& name : instruction_sets()) {
    ASSERT_TRUE(use_instruction_set(name).ok());
    if (active_ray_kernels() == nullptr) continue;  // the portable way has none
    EXPECT_EQ(trial.difference(*active_ray_kernels()), "") << name;
    EXPECT_EQ(regions.difference(*active_region_kernels()), "") << name;
  }
  ASSERT_TRUE(use_instruction_set("").ok());
}

TEST(TreeTopologyTest, OneThatIsDeeperIsRefused) {
  EXPECT_EQ(Chain(limits::kMaxBvhDepth + 1).tree().status().message(),
            "the outline of the tree does not fit: too deep");
}

TEST(TreeTopologyTest, CancelledItMakesNone) {
  const std::vector<Triangle> triangles = box_city(3, 1);
  const TriangleBvh built = *TriangleBvh::build(triangles);
  const std::atomic<bool> cancel = true;
  BvhOptions options;
  options.cancel = &cancel;
  EXPECT_EQ(restore(built.topology(), triangles, options).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace locus::test
