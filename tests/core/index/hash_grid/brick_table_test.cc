#include "core/index/hash_grid/brick_table.h"

#include <gtest/gtest.h>

#include <map>

#include "tests/support/random.h"

namespace locus::internal {
namespace {

TEST(BrickTableTest, AnEmptyTableFindsNoBrick) {
  const BrickTable table;
  EXPECT_EQ(table.find({1, 2, 3}, [](uint32_t) { return true; }), BrickTable::kNone);
  EXPECT_TRUE(table.for_each([](uint32_t) { return false; }));
}

// Inserts and erases keys from a small range, so that searches probe slots whose entries erase() has moved.
TEST(BrickTableTest, EqualsAMapThroughRandomInsertsAndErases) {
  test::Random random(7);
  BrickTable table;
  std::map<GridKey, uint32_t> model;
  std::vector<GridKey> keys;  // key of each brick, by the brick's index
  for (int step = 0; step < 20'000; ++step) {
    const GridKey key{random.whole(-5, 5), random.whole(-5, 5), random.whole(-3, 3)};
    const auto known = model.find(key);
    if (known != model.end()) {
      table.erase(key, known->second);
      model.erase(known);
    } else {
      keys.push_back(key);
      const auto brick = static_cast<uint32_t>(keys.size() - 1);
      table.insert(key, brick);
      model.emplace(key, brick);
    }
    ASSERT_EQ(table.size(), model.size());
    const GridKey sought{random.whole(-5, 5), random.whole(-5, 5), random.whole(-3, 3)};
    const auto expected = model.find(sought);
    const uint32_t found = table.find(sought, [&](uint32_t brick) { return keys[brick] == sought; });
    ASSERT_EQ(found, expected == model.end() ? BrickTable::kNone : expected->second) << "step " << step;
  }
  size_t seen = 0;
  table.for_each([&](uint32_t brick) {
    seen += model.at(keys[brick]) == brick;
    return true;
  });
  EXPECT_EQ(seen, model.size());
}

TEST(BrickTableDeathTest, ErasingAnAbsentBrickIsAProgrammerError) {
  BrickTable table;
  table.insert({1, 1, 1}, 4);
  EXPECT_DEATH(table.erase({1, 1, 1}, 5), "kNone");
}

}  // namespace
}  // namespace locus::internal
