#include "core/scene/tree_codec.h"

#include <gtest/gtest.h>

#include "core/index/bvh/triangle_bvh.h"
#include "tests/support/damaged_bytes.h"
#include "tests/support/generated_meshes.h"
#include "tests/support/scene_search.h"

namespace locus::test {
namespace {

absl::StatusOr<TriangleBvh> restore(const std::string& bytes, const std::vector<Triangle>& triangles) {
  const AlignedBytes aligned(bytes);
  const absl::StatusOr<TreeOutline> outline = decode_outline(aligned);
  if (!outline.ok()) return outline.status();
  const auto triangle = [&](uint32_t number) { return triangles[number]; };
  return TriangleBvh::restore(*outline, static_cast<uint32_t>(triangles.size()), triangle);
}

std::string encoded(const std::vector<Triangle>& triangles) {
  return encode_outline(TriangleBvh::build(triangles)->outline());
}

TEST(TreeCodecTest, AnOutlineComesBackAndTakesFiveBytesATriangle) {
  for (const std::vector<Triangle>& triangles : {bumpy_sphere(40, 0.05, 6), box_city(1, 1)}) {
    const TriangleBvh built = *TriangleBvh::build(triangles);
    const std::string bytes = encode_outline(built.outline());
    EXPECT_LT(bytes.size(), 5 * triangles.size() + 64);
    const AlignedBytes aligned(bytes);
    const absl::StatusOr<TreeOutline> outline = decode_outline(aligned);
    ASSERT_TRUE(outline.ok()) << outline.status();
    EXPECT_EQ(outline->numbers, built.outline().numbers);
    EXPECT_EQ(outline->block_sizes, built.outline().block_sizes);
    EXPECT_EQ(outline->nodes, built.outline().nodes);
  }
}

TEST(TreeCodecTest, TheOutlineOfAnotherBuilderIsRefused) {
  std::string bytes = encoded(box_city(1, 1));
  ++bytes[8];
  EXPECT_EQ(restore(bytes, box_city(1, 1)).status().code(), absl::StatusCode::kFailedPrecondition);
}

// Whether it is refused or not: no answer is wrong.
TEST(TreeCodecTest, DamagedBytesNeverHarm) {
  Random random(3);
  uint64_t refused = 0, slower = 0;
  const TestScene<Triangle> scene = make_scene<Triangle>(random_scene(random), random);
  std::vector<Triangle> triangles = scene.values;
  number_in_order(triangles);
  ASSERT_GT(triangles.size(), 20u);
  TestScene<Triangle> numbered = scene;
  numbered.values = triangles;
  const ListIndex<Triangle> oracle = make_list(triangles);
  const std::string bytes = encoded(triangles);
  for (uint64_t i = 0; i < scaled_count(20'000); ++i) {
    const absl::StatusOr<TriangleBvh> tree = restore(damaged(bytes, random), triangles);
    if (!tree.ok()) {
      ++refused;
    } else {
      ++slower;
      ASSERT_EQ(IndexJudge<TriangleBvh>(*tree, oracle).difference(numbered), "");
    }
  }
  EXPECT_GT(refused, 100u);
  EXPECT_GT(slower, 100u);
}

// If this fails, the builder makes other trees than it did: raise kBvhBuilderVersion and put the new number here, so
// that data directories with outlines of the trees before get the new ones.
TEST(TreeCodecTest, TheBuilderOfThisVersionMakesTheseTrees) {
  uint64_t hash = 14'695'981'039'346'656'037u;  // FNV-1a
  for (const char byte : encoded(box_city(9, 3))) hash = (hash ^ static_cast<uint8_t>(byte)) * 1'099'511'628'211u;
  EXPECT_EQ(kBvhBuilderVersion, 1u);
  EXPECT_EQ(hash, 2'252'812'711'579'794'862u);
}

}  // namespace
}  // namespace locus::test
