#include "core/scene/log/tree_codec.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/base/instruction_set.h"
#include "core/index/bvh/triangle_bvh.h"
#include "tests/support/damaged_bytes.h"
#include "tests/support/generated_meshes.h"
#include "tests/support/scene_search.h"

namespace locus::test {
namespace {

absl::StatusOr<TriangleBvh> restore(const std::string& bytes, const std::vector<Triangle>& triangles) {
  const AlignedBytes aligned(bytes);
  const absl::StatusOr<TreeTopology> topology = decode_topology(aligned);
  if (!topology.ok()) return topology.status();
  const auto triangle = [&](uint32_t number) { return triangles[number]; };
  return TriangleBvh::restore(*topology, static_cast<uint32_t>(triangles.size()), triangle);
}

std::string encoded(const std::vector<Triangle>& triangles) {
  return encode_topology(TriangleBvh::build(triangles)->topology());
}

TEST(TreeCodecTest, ATopologyRoundTripsAndTakesFiveBytesATriangle) {
  for (const std::vector<Triangle>& triangles : {bumpy_sphere(40, 0.05, 6), box_city(1, 1)}) {
    const TriangleBvh built = *TriangleBvh::build(triangles);
    const std::string bytes = encode_topology(built.topology());
    EXPECT_LT(bytes.size(), 5 * triangles.size() + 64);
    const AlignedBytes aligned(bytes);
    const absl::StatusOr<TreeTopology> topology = decode_topology(aligned);
    ASSERT_TRUE(topology.ok()) << topology.status();
    EXPECT_EQ(topology->numbers, built.topology().numbers);
    EXPECT_EQ(topology->block_sizes, built.topology().block_sizes);
    EXPECT_EQ(topology->nodes, built.topology().nodes);
  }
}

TEST(TreeCodecTest, TheTopologyOfAnotherBuilderVersionIsRefused) {
  std::string bytes = encoded(box_city(1, 1));
  ++bytes[8];
  EXPECT_EQ(restore(bytes, box_city(1, 1)).status().code(), absl::StatusCode::kFailedPrecondition);
}

// The encoded topology does not contain the instruction set, because all instruction sets build equal trees.
TEST(TreeCodecTest, EveryInstructionSetMakesTheSameTopology) {
  const std::string bytes = encoded(bumpy_sphere(40, 0.05, 6));
  for (const std::string& name : instruction_sets()) {
    ASSERT_TRUE(use_instruction_set(name).ok());
    EXPECT_EQ(encoded(bumpy_sphere(40, 0.05, 6)), bytes) << name;
  }
  ASSERT_TRUE(use_instruction_set("").ok());
}

class DamagedTopologyTest : public ::testing::Test {
 protected:
  DamagedTopologyTest() : scene_(make_scene<Triangle>(random_scene(random_), random_)) {
    number_in_order(scene_.values);
    oracle_ = make_list(scene_.values);
    bytes_ = encoded(scene_.values);
  }

  // Returns true if a tree can be restored from the bytes. Expects that queries of a restored tree return correct
  // answers.
  bool is_taken(const std::string& bytes) {
    const absl::StatusOr<TriangleBvh> tree = restore(bytes, scene_.values);
    if (!tree.ok()) return false;
    EXPECT_EQ(IndexJudge<TriangleBvh>(*tree, oracle_).difference(scene_), "");
    return true;
  }

  Random random_{3};
  TestScene<Triangle> scene_;
  ListIndex<Triangle> oracle_;
  std::string bytes_;
};

// In the encoded topology, the triangle numbers come after the kind, the builder version and the count of triangles.
TEST_F(DamagedTopologyTest, ASwapOfTriangleNumbersIsAcceptedAndAnswersStayCorrect) {
  constexpr size_t kNumbers = 24;
  ASSERT_GT(scene_.values.size(), 20u);
  for (uint64_t i = 0; i < scaled_count(300); ++i) {
    std::string wrong = bytes_;
    for (size_t swaps = 1 + random_.below(9); swaps > 0; --swaps) {
      const size_t one = random_.below(scene_.values.size()), other = random_.below(scene_.values.size());
      if (one == other) continue;
      char* const numbers = &wrong[kNumbers];
      std::swap_ranges(numbers + 4 * one, numbers + 4 * one + 4, numbers + 4 * other);
    }
    ASSERT_TRUE(is_taken(wrong));
  }
}

TEST_F(DamagedTopologyTest, RandomDamageIsRefusedOrAnswersStayCorrect) {
  uint64_t refused = 0;
  for (uint64_t i = 0; i < scaled_count(20'000); ++i) refused += is_taken(damaged(bytes_, random_)) ? 0 : 1;
  EXPECT_GT(refused, scaled_count(10'000));
}

// If this test fails, the builder makes different trees than before: increment kBvhBuilderVersion, so that topologies
// cached in data directories are rebuilt, and update the expected values of this test.
TEST(TreeCodecTest, TheTreesOfThisBuilderVersionHaveTheRecordedHash) {
  uint64_t hash = 14'695'981'039'346'656'037u;  // offset basis of FNV-1a
  for (const char byte : encoded(box_city(9, 3))) hash = (hash ^ static_cast<uint8_t>(byte)) * 1'099'511'628'211u;
  EXPECT_EQ(kBvhBuilderVersion, 1u);
  EXPECT_EQ(hash, 2'252'812'711'579'794'862u);
}

}  // namespace
}  // namespace locus::test
