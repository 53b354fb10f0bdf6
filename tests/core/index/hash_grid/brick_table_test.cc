#include "core/index/hash_grid/brick_table.h"

#include <gtest/gtest.h>

#include <map>

#include "tests/support/random.h"

namespace locus::internal {
namespace {

TEST(BrickTableTest, AnEmptyTableFindsNothing) {
  const BrickTable table;
  EXPECT_EQ(table.find({1, 2, 3}, [](uint32_t) { return true; }), BrickTable::kNone);
  EXPECT_TRUE(table.for_each([](uint32_t) { return false; }));
}

// Keys from a small range come and go, so that probes cross gaps that were closed.
TEST(BrickTableTest, FindsWhatAMapFindsThroughRandomInsertsAndErases) {
  test::Random random(7);
  BrickTable table;
  std::map<GridKey, uint32_t> model;
  std::vector<GridKey> keys;  // by number
  for (int step = 0; step < 20'000; ++step) {
    const GridKey key{random.whole(-5, 5), random.whole(-5, 5), random.whole(-3, 3)};
    const auto known = model.find(key);
    if (known != model.end()) {
      table.erase(key, known->second);
      model.erase(known);
    } else {
      keys.push_back(key);
      const auto number = static_cast<uint32_t>(keys.size() - 1);
      table.insert(key, number);
      model.emplace(key, number);
    }
    ASSERT_EQ(table.size(), model.size());
    const GridKey asked{random.whole(-5, 5), random.whole(-5, 5), random.whole(-3, 3)};
    const auto expected = model.find(asked);
    const uint32_t found = table.find(asked, [&](uint32_t number) { return keys[number] == asked; });
    ASSERT_EQ(found, expected == model.end() ? BrickTable::kNone : expected->second) << "step " << step;
  }
  size_t seen = 0;
  table.for_each([&](uint32_t number) {
    seen += model.at(keys[number]) == number;
    return true;
  });
  EXPECT_EQ(seen, model.size());
}

TEST(BrickTableDeathTest, ErasingWhatIsNotThereIsAProgrammersError) {
  BrickTable table;
  table.insert({1, 1, 1}, 4);
  EXPECT_DEATH(table.erase({1, 1, 1}, 5), "kNone");
}

}  // namespace
}  // namespace locus::internal
