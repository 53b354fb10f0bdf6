#include "core/mesh/packed_indices.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/random.h"

namespace locus::test {
namespace {

std::vector<uint32_t> unpacked(const PackedIndices& packed, size_t count) {
  PackedIndices::Reader reader(packed);
  std::vector<uint32_t> indices(count);
  for (uint32_t& index : indices) index = reader.next();
  return indices;
}

void expect_restored(const std::vector<uint32_t>& indices) {
  EXPECT_EQ(unpacked(PackedIndices(indices), indices.size()), indices);
}

TEST(PackedIndicesTest, AnyListIsRestoredExactly) {
  constexpr uint32_t kLargest = std::numeric_limits<uint32_t>::max();
  expect_restored({});
  expect_restored({0, 1, 2, 0, 2, 3});
  expect_restored({3, 2, 1, 0});
  expect_restored({kLargest, 0, kLargest, 1, kLargest - 1, 63, 64, 65, 8191, 8192, 8193});
}

TEST(PackedIndicesTest, RandomListsAreRestoredExactly) {
  Random random(4);
  for (const int largest : {1, 200, 20'000, 2'000'000'000}) {
    std::vector<uint32_t> indices(3'000);
    for (uint32_t& index : indices) index = static_cast<uint32_t>(random.whole(0, largest));
    expect_restored(indices);
  }
}

TEST(PackedIndicesTest, IndicesOfNeighboursTakeOneByteEach) {
  std::vector<uint32_t> strip;
  for (uint32_t i = 0; i < 1'000; ++i)
    for (uint32_t corner = 0; corner < 3; ++corner) strip.push_back(i + corner);
  EXPECT_EQ(PackedIndices(strip).bytes(), strip.size());
}

}  // namespace
}  // namespace locus::test
