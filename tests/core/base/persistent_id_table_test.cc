#include "core/base/persistent_id_table.h"

#include <gtest/gtest.h>

#include <map>
#include <numeric>
#include <vector>

#include "tests/support/random.h"

namespace locus::test {
namespace {

using Model = std::map<Id, uint32_t>;

struct FewHashes {
  uint64_t operator()(Id id) const { return id % 3 << 62; }
};
struct LastHash {
  uint64_t operator()(Id) const { return ~uint64_t{0}; }
};
// Hash whose highest six bits are the low six bits of an id. In a table of one leaf, these six bits select one of the
// 64 buckets.
struct LowBits {
  uint64_t operator()(Id id) const { return id << 58; }
};

template <class Table>
void expect_equal(const Table& table, const Model& model, Id ids) {
  ASSERT_EQ(table.size(), model.size());
  std::vector<Id> all(ids + 1);
  std::iota(all.begin(), all.end(), Id{0});
  std::vector<uint32_t> values(all.size());
  table.find(all, absl::MakeSpan(values));
  for (const Id id : all) {
    const auto known = model.find(id);
    const uint32_t expected = known == model.end() ? Table::kNone : known->second;
    EXPECT_EQ(table.find(id), expected) << id;
    EXPECT_EQ(values[id], expected) << id;
  }
}

// Applies random writes to a table and to its model, a std::map; expects that snapshots made in between do not change.
// In the first half of the steps most writes are inserts, in the second half most are erases.
template <class Hash>
void check_against_model(Id ids, uint32_t steps, uint64_t seed) {
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  Random random(seed);
  std::vector<std::pair<PersistentIdTable<Hash>, Model>> kept;
  PersistentIdTable<Hash> table;
  Model model;
  for (uint32_t step = 0; step < steps; ++step) {
    const Id id = 1 + random.below(ids);
    if (random.chance(step < steps / 2 ? 0.7 : 0.3)) {
      EXPECT_EQ(table.set(id, step), model.insert_or_assign(id, step).second);
    } else {
      EXPECT_EQ(table.erase(id), model.erase(id) == 1);
    }
    if (random.chance(0.01)) table.fit(table.size());
    if (random.chance(20.0 / steps)) kept.emplace_back(table.snapshot(), model);
  }
  expect_equal(table, model, ids);
  ASSERT_GT(kept.size(), 5u);
  for (const auto& [snapshot, expected] : kept) expect_equal(snapshot, expected, ids);
}

TEST(PersistentIdTableTest, AnEmptyTableFindsAndErasesNothing) {
  PersistentIdTable<> table;
  EXPECT_FALSE(table.erase(1));
  table.prefetch(1);
  expect_equal(table, {}, 10);
}

TEST(PersistentIdTableTest, TableAndSnapshotsEqualAMap) {
  for (uint64_t seed = 1; seed <= 4; ++seed) check_against_model<SeededHash>(Id{50} << (2 * seed), 20'000, seed);
}

TEST(PersistentIdTableTest, IdsWithEqualHashesAreDistinguished) {
  check_against_model<FewHashes>(500, 5'000, 5);
  check_against_model<LastHash>(500, 5'000, 6);
}

TEST(PersistentIdTableTest, TheNullIdIsNeverFoundNorErased) {
  PersistentIdTable<> table;
  table.set(1, 10);
  EXPECT_EQ(table.find(kNoId), PersistentIdTable<>::kNone);
  EXPECT_FALSE(table.erase(kNoId));
  EXPECT_EQ(table.size(), 1u);
}

TEST(PersistentIdTableTest, ASearchEndsAlthoughEveryBucketHasOverflowed) {
  PersistentIdTable<LowBits> table;
  Model model;
  // Inserts six ids per bucket: five fit, and the last overflows to a later bucket. Then erases the five.
  for (Id bucket = 0; bucket < 64; ++bucket) {
    for (Id i = 1; i <= 6; ++i) table.set(i << 6 | bucket, 7);
    for (Id i = 1; i <= 5; ++i) ASSERT_TRUE(table.erase(i << 6 | bucket));
    model[Id{6} << 6 | bucket] = 7;
  }
  expect_equal(table, model, 1'000);
  EXPECT_FALSE(table.erase(5));
}

TEST(PersistentIdTableTest, TakesFewBytesPerIdAndFreesUnusedMemory) {
  constexpr size_t kIds = 100'000;
  PersistentIdTable<> table;
  table.fit(kIds);
  for (Id id = 1; id <= kIds; ++id) table.set(id, 1);
  EXPECT_LT(table.bytes(), 24 * kIds);
  for (Id id = 1; id <= kIds; ++id) {
    table.set(kIds + id, 2);
    table.erase(id);
  }
  EXPECT_LT(table.bytes(), 36 * kIds);
  for (Id id = 101; id <= kIds; ++id) table.erase(kIds + id);
  table.fit(100);
  EXPECT_LT(table.bytes(), 10'000u);
  for (Id id = 1; id <= 100; ++id) EXPECT_EQ(table.find(kIds + id), 2u);
  for (Id id = 1; id <= 100; ++id) table.erase(kIds + id);
  table.fit(0);
  EXPECT_LT(table.bytes(), 100u);
}

TEST(PersistentIdTableTest, OnlyLeavesWrittenSinceTheSnapshotAreUnshared) {
  PersistentIdTable<> table;
  for (Id id = 1; id <= 10'000; ++id) table.set(id, 1);
  const PersistentIdTable<> before = table.snapshot();
  EXPECT_EQ(before.unshared_bytes(table.snapshot()), 0u);
  table.set(500, 2);
  const PersistentIdTable<> after = table.snapshot();
  EXPECT_GT(before.unshared_bytes(after), 0u);
  EXPECT_LT(before.unshared_bytes(after) * 10, before.bytes());
  EXPECT_EQ(before.find(500), 1u);
  EXPECT_EQ(after.find(500), 2u);
}

TEST(PersistentIdTableTest, ReplacedBytesCountLeavesThatOnlySnapshotsHold) {
  PersistentIdTable<> table;
  for (Id id = 1; id <= 10'000; ++id) table.set(id, 1);
  table.take_replaced_bytes();
  const PersistentIdTable<> before = table.snapshot();
  table.set(500, 2);
  table.set(500, 3);
  const size_t replaced = table.take_replaced_bytes();
  EXPECT_GT(replaced, 0u);
  EXPECT_LE(replaced, before.unshared_bytes(table.snapshot()));
  EXPECT_EQ(table.take_replaced_bytes(), 0u);
  table.fit(40'000);
  EXPECT_GT(table.take_replaced_bytes() * 10, before.bytes() * 9);
}

TEST(PersistentIdTableTest, TwoCopiesWrittenAlternatelyAreIndependent) {
  PersistentIdTable<> left;
  for (Id id = 1; id <= 100; ++id) left.set(id, 0);
  PersistentIdTable<> right = left.snapshot();
  for (Id id = 1; id <= 100; ++id) {
    left.set(id, 1);
    right.set(id, 2);
  }
  for (Id id = 1; id <= 100; ++id) {
    EXPECT_EQ(left.find(id), 1u);
    EXPECT_EQ(right.find(id), 2u);
  }
}

}  // namespace
}  // namespace locus::test
