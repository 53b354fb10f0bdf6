// Tests of trees restored from a topology. A tree restored from its own topology equals the built tree byte for byte; a
// tree restored from any other topology gives the same answers.
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

// Restores a tree from `topology`. `triangles` are in the order of their numbers.
absl::StatusOr<TriangleBvh> restore(const TreeTopology& topology, const std::vector<Triangle>& triangles,
                                    const BvhOptions& options = {}) {
  const auto triangle = [&](uint32_t number) { return triangles[number]; };
  return TriangleBvh::restore(topology, static_cast<uint32_t>(triangles.size()), triangle, options);
}

TEST(TreeTopologyTest, ATreeIsRestoredByteForByteOnAnyThreads) {
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

TEST(TreeTopologyTest, TreesOfEverySmallSizeAreRestored) {
  const std::vector<Triangle> all = bumpy_sphere(6, 0.1, 2);
  for (size_t count = 1; count <= all.size(); ++count) {
    const std::vector<Triangle> some(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count));
    const TriangleBvh built = *TriangleBvh::build(some);
    const absl::StatusOr<TriangleBvh> restored = restore(built.topology(), some);
    ASSERT_TRUE(restored.ok()) << restored.status();
    expect_equal_bytes(*restored, built);
  }
}

// Returns the first difference between the answers of a tree restored from a random topology and those of a list of the
// same values. There must be no difference: a stored topology that is wrong may cost speed, but not correctness.
std::string difference_of_any_topology(const TestScene<Triangle>& scene) {
  if (scene.values.empty()) return "";
  TestScene<Triangle> numbered = scene;
  numbered.values = renumbered(scene.values);
  Random random(scene.values.size());
  const RandomTopology made(static_cast<uint32_t>(scene.values.size()), random);
  const absl::StatusOr<TriangleBvh> tree = restore(made.topology(), numbered.values);
  if (!tree.ok()) return tree.status().ToString();
  const ListIndex<Triangle> oracle = make_list(numbered.values);
  return IndexJudge<TriangleBvh>(*tree, oracle).difference(numbered);
}

TEST(TreeTopologyTest, ATreeOfAnyTopologyThatFitsAnswersAsTheListDoes) {
  EXPECT_EQ(search_all_scenes<Triangle>(scaled_count(1'000), scaled_count(300), difference_of_any_topology), "");
}

TEST(TreeTopologyTest, KernelsAnswerATreeOfAnyTopologyAsAllTrianglesDo) {
  const std::vector<Triangle> triangles = bumpy_sphere(14, 0.1, 1);
  for (const std::string& name : instruction_sets()) {
    ASSERT_TRUE(use_instruction_set(name).ok());
    const RayKernels* const kernels = active_ray_kernels();
    const RegionKernels* const region_kernels = active_region_kernels();
    if (kernels == nullptr) continue;  // the portable instruction set has no kernels
    for (uint64_t seed = 0; seed < 4; ++seed) {
      Random random(seed);
      const RandomTopology made(static_cast<uint32_t>(triangles.size()), random);
      absl::StatusOr<TriangleBvh> tree = restore(made.topology(), triangles);
      ASSERT_TRUE(tree.ok()) << tree.status();
      const KernelTrial trial(absl::StrCat("topology ", seed), triangles,
                              random_questions(triangles, scaled_count(500), seed), *std::move(tree));
      EXPECT_EQ(trial.difference(*kernels), "") << name;
      tree = restore(made.topology(), triangles);
      const RegionTrial regions = random_region_trial("regions", triangles, *std::move(tree), scaled_count(100), seed);
      EXPECT_EQ(regions.difference(*region_kernels), "") << name;
    }
  }
  ASSERT_TRUE(use_instruction_set("").ok());
}

class WrongTopologyTest : public ::testing::Test {
 protected:
  WrongTopologyTest() : built_(*TriangleBvh::build(triangles_)), wrong_(built_.topology()) {
    numbers_.assign(wrong_.numbers.begin(), wrong_.numbers.end());
    wrong_.numbers = numbers_;
  }
  std::string refused() { return std::string(restore(wrong_, triangles_).status().message()); }

  const std::vector<Triangle> triangles_ = box_city(3, 1);
  const TriangleBvh built_;
  std::vector<uint32_t> numbers_;
  TreeTopology wrong_;
};

TEST_F(WrongTopologyTest, TheTopologyOfTheTreeIsAccepted) { EXPECT_EQ(refused(), ""); }

TEST_F(WrongTopologyTest, ATopologyOfOtherTrianglesIsRefused) {
  numbers_[5] = numbers_[4];
  EXPECT_EQ(refused(), "the topology does not fit the mesh: a triangle number is repeated or out of range");
  numbers_[5] = static_cast<uint32_t>(numbers_.size());
  EXPECT_EQ(refused(), "the topology does not fit the mesh: a triangle number is repeated or out of range");
  wrong_.numbers.remove_suffix(1);
  EXPECT_EQ(refused(), "the topology does not fit the mesh: different number of triangles");
}

TEST_F(WrongTopologyTest, BlocksThatDoNotAddUpAreRefused) {
  const std::vector<uint8_t> sizes = wrong_.block_sizes;
  for (const int size : {0, 9, 255}) {
    wrong_.block_sizes[1] = static_cast<uint8_t>(size);
    EXPECT_EQ(refused(), "the topology does not fit the mesh: block size out of range");
  }
  wrong_.block_sizes = sizes;
  wrong_.block_sizes.pop_back();
  EXPECT_EQ(refused(), "the topology does not fit the mesh: block sizes do not add up to the number of triangles");
}

TEST_F(WrongTopologyTest, NodesThatDoNotFormATreeAreRefused) {
  const std::vector<TopologyNode> nodes = wrong_.nodes;
  wrong_.nodes.clear();
  EXPECT_EQ(refused(), "the topology does not fit the mesh: no nodes, or more nodes or blocks than triangles");
  wrong_.nodes = nodes;
  wrong_.nodes.pop_back();
  EXPECT_EQ(refused(), "the topology does not fit the mesh: too few nodes");
  wrong_.nodes = nodes;
  wrong_.nodes.push_back({1, 0});
  EXPECT_EQ(refused(), "the topology does not fit the mesh: too many nodes");
  for (const TopologyNode children : {TopologyNode{0, 0}, TopologyNode{1, 1}, TopologyNode{2, 0}, TopologyNode{4, 1}}) {
    wrong_.nodes = nodes;
    wrong_.nodes.back() = children;
    EXPECT_EQ(refused(), "the topology does not fit the mesh: invalid children of a node");
  }
  wrong_.nodes = nodes;
  const auto has_room = [](const TopologyNode& node) { return node.nodes == 0 && node.blocks < 0x7F; };
  std::find_if(wrong_.nodes.rbegin(), wrong_.nodes.rend(), has_room)->blocks = 0xFF;
  EXPECT_EQ(refused(), "the topology does not fit the mesh: too few blocks");
  wrong_.nodes = nodes;
  wrong_.nodes.back() = {1, 0};
  EXPECT_EQ(refused(), "the topology does not fit the mesh: too many blocks");
}

// Tree that is a chain of nodes: the children of each node but the last are seven blocks and the next node. The
// triangles of every block are spread over the mesh, so that queries intersect every box and the stack of a visit
// reaches its maximum length.
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
    topology_.numbers = numbers_;
    topology_.block_sizes.assign(blocks, kTreeWidth);
    topology_.nodes.assign(levels - 1, TopologyNode{0x7F, 0x80});
    topology_.nodes.push_back({0xFF, 0});
  }
  Chain(const Chain&) = delete;
  Chain& operator=(const Chain&) = delete;

  const std::vector<Triangle>& triangles() const { return triangles_; }
  absl::StatusOr<TriangleBvh> tree() const { return restore(topology_, triangles_); }

 private:
  std::vector<Triangle> triangles_;
  std::vector<uint32_t> numbers_;
  TreeTopology topology_;
};

TEST(TreeTopologyTest, ATreeOfTheMaximumDepthIsVisitedCompletely) {
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
    if (active_ray_kernels() == nullptr) continue;  // the portable instruction set has no kernels
    EXPECT_EQ(trial.difference(*active_ray_kernels()), "") << name;
    EXPECT_EQ(regions.difference(*active_region_kernels()), "") << name;
  }
  ASSERT_TRUE(use_instruction_set("").ok());
}

TEST(TreeTopologyTest, ATopologyDeeperThanTheLimitIsRefused) {
  EXPECT_EQ(Chain(limits::kMaxBvhDepth + 1).tree().status().message(), "the topology does not fit the mesh: too deep");
}

TEST(TreeTopologyTest, ACancelledRestoreReturnsCancelled) {
  const std::vector<Triangle> triangles = box_city(3, 1);
  const TriangleBvh built = *TriangleBvh::build(triangles);
  const std::atomic<bool> cancel = true;
  BvhOptions options;
  options.cancel = &cancel;
  EXPECT_EQ(restore(built.topology(), triangles, options).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace locus::test
