#include "core/base/persistent_array.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/random.h"

namespace locus {
namespace {

using Array = PersistentArray<uint32_t, 4>;

std::vector<uint32_t> values_of(const Array& array) {
  std::vector<uint32_t> values;
  for (size_t index = 0; index < array.size(); ++index) values.push_back(array[index]);
  return values;
}

TEST(PersistentArrayTest, ElementsThatWereNeverSetHoldTheDefault) {
  Array array;
  EXPECT_EQ(array.size(), 0u);
  array.set(9, 7);
  EXPECT_EQ(values_of(array), (std::vector<uint32_t>{0, 0, 0, 0, 0, 0, 0, 0, 0, 7}));
}

TEST(PersistentArrayTest, SnapshotsKeepTheirValuesWhileTheArrayChanges) {
  test::Random random(1);
  Array array;
  std::vector<uint32_t> model;
  std::vector<std::pair<Array, std::vector<uint32_t>>> kept;
  for (uint32_t step = 0; step < 2'000; ++step) {
    const size_t index = random.below(model.size() + 3);
    if (index >= model.size()) model.resize(index + 1);
    model[index] = step;
    array.set(index, step);
    if (random.chance(0.1)) kept.emplace_back(array.snapshot(), model);
    if (model.size() > 60) break;
  }
  ASSERT_GT(kept.size(), 2u);
  for (const auto& [snapshot, expected] : kept) EXPECT_EQ(values_of(snapshot), expected);
  EXPECT_EQ(values_of(array), model);
}

TEST(PersistentArrayTest, AWriteToASnapshotDoesNotChangeTheOthers) {
  Array array;
  array.set(0, 1);
  Array first = array.snapshot();
  const Array second = array.snapshot();
  first.set(0, 2);
  array.set(0, 3);
  EXPECT_EQ(first[0], 2u);
  EXPECT_EQ(second[0], 1u);
  EXPECT_EQ(array[0], 3u);
}

TEST(PersistentArrayDeathTest, CopyingAWrittenArrayFailsACheck) {
  Array array;
  array.set(0, 1);
  EXPECT_DEATH(Array copy(array), "owner");
}

TEST(PersistentArrayTest, OnlyLeavesWrittenSinceTheSnapshotAreUnshared) {
  Array array;
  for (uint32_t index = 0; index < 1000; ++index) array.set(index, 1);
  const Array before = array.snapshot();
  EXPECT_EQ(before.unshared_bytes(before), 0u);
  array.set(500, 2);
  const Array after = array.snapshot();
  size_t changed = 0, seen = 0;
  before.for_each_apart_from(after, [&](const auto& mine, const auto* theirs) {
    ++seen;
    if (theirs == nullptr || mine != *theirs) ++changed;
  });
  EXPECT_EQ(changed, 1u);
  EXPECT_LT(seen, 1000u);
  EXPECT_GT(before.unshared_bytes(after), 0u);
  EXPECT_LT(before.unshared_bytes(after), before.unshared_bytes(Array()));
}

}  // namespace
}  // namespace locus
