#include "core/base/persistent_map.h"

#include <atomic>
#include <memory>
#include <mutex>
#include <random>
#include <thread>
#include <unordered_map>

#include "gtest/gtest.h"

namespace locus {
namespace {

#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr int kScale = 1;
#else
constexpr int kScale = 8;
#endif

using Model = std::unordered_map<uint64_t, uint64_t>;

struct FewHashes {
  size_t operator()(uint64_t key) const { return key % 3; }
};
struct LowDigitsEqual {  // the first twelve branches cannot tell keys apart
  size_t operator()(uint64_t key) const { return static_cast<size_t>(key << 48); }
};

template <class Map>
void expect_equal(const Map& map, const Model& model) {
  ASSERT_EQ(map.size(), model.size());
  EXPECT_EQ(map.empty(), model.empty());
  Model seen;
  map.for_each([&](uint64_t key, uint64_t value) { EXPECT_TRUE(seen.emplace(key, value).second) << key; });
  EXPECT_EQ(seen, model);
  for (const auto& [key, value] : model) {
    const uint64_t* found = map.find(key);
    ASSERT_NE(found, nullptr) << key;
    EXPECT_EQ(*found, value) << key;
  }
}

// Random writes to a map and its model, where every copy kept along the way must stay what it was.
template <class Map>
void check_against_model(uint64_t keys, int steps, uint64_t seed) {
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  std::vector<std::pair<Map, Model>> kept;
  Map map;
  Model model;
  for (int step = 0; step < steps; ++step) {
    const uint64_t key = random() % keys;
    if (random() % 8 < 5) {
      EXPECT_EQ(map.set(key, step), model.insert_or_assign(key, step).second);
    } else {
      EXPECT_EQ(map.erase(key), model.erase(key) == 1);
    }
    EXPECT_EQ(map.find(key) != nullptr, model.contains(key));
    if (random() % (static_cast<uint64_t>(steps) / 40) == 0) kept.emplace_back(map, model);
    if (!kept.empty() && random() % 400 == 0) std::tie(map, model) = kept[random() % kept.size()];
  }
  expect_equal(map, model);
  ASSERT_GE(kept.size(), 10u);
  for (const auto& [copy, copied_model] : kept) expect_equal(copy, copied_model);
}

TEST(PersistentMapTest, AnEmptyMapFindsAndErasesNothing) {
  PersistentMap<uint64_t, uint64_t> map;
  EXPECT_EQ(map.find(1), nullptr);
  EXPECT_FALSE(map.erase(1));
  expect_equal(map, {});
}

TEST(PersistentMapTest, EqualsAModelAndSoDoesEveryCopyKept) {
  for (uint64_t seed = 1; seed <= 4; ++seed) {
    check_against_model<PersistentMap<uint64_t, uint64_t>>(50 << (2 * seed), 5000 * kScale, seed);
  }
}

TEST(PersistentMapTest, KeysOfEqualHashesShareOneLeaf) {
  check_against_model<PersistentMap<uint64_t, uint64_t, FewHashes>>(200, 2000 * kScale, 5);
}

TEST(PersistentMapTest, HashesThatDifferOnlyAtTheEndAreToldApart) {
  check_against_model<PersistentMap<uint64_t, uint64_t, LowDigitsEqual>>(1000, 2000 * kScale, 6);
}

TEST(PersistentMapTest, ErasingEverythingLeavesAnEmptyMapAndTheCopyWhole) {
  PersistentMap<uint64_t, uint64_t> map;
  Model model;
  for (uint64_t key = 0; key < 10000; ++key) map.set(key, key * key), model[key] = key * key;
  const PersistentMap<uint64_t, uint64_t> copy = map;
  for (uint64_t key = 0; key < 10000; ++key) EXPECT_TRUE(map.erase(key));
  expect_equal(map, {});
  expect_equal(copy, model);
}

TEST(PersistentMapTest, TwoCopiesWrittenAlternatelyDoNotSeeEachOther) {
  PersistentMap<uint64_t, uint64_t> left;
  for (uint64_t key = 0; key < 100; ++key) left.set(key, 0);
  PersistentMap<uint64_t, uint64_t> right = left;
  for (uint64_t key = 0; key < 100; ++key) {
    left.set(key, 1);
    right.set(key, 2);
  }
  for (uint64_t key = 0; key < 100; ++key) {
    EXPECT_EQ(*left.find(key), 1u);
    EXPECT_EQ(*right.find(key), 2u);
  }
}

TEST(PersistentMapTest, AMovedMapKeepsItsEntriesAndTheSourceIsEmpty) {
  PersistentMap<uint64_t, uint64_t> map;
  map.set(1, 10);
  PersistentMap<uint64_t, uint64_t> moved = std::move(map);
  map = PersistentMap<uint64_t, uint64_t>();
  map.set(2, 20);
  moved.set(3, 30);
  expect_equal(map, {{2, 20}});
  expect_equal(moved, {{1, 10}, {3, 30}});
}

TEST(PersistentMapTest, ValuesDieWithTheLastMapThatHoldsThem) {
  const auto token = std::make_shared<int>(7);
  {
    PersistentMap<uint64_t, std::shared_ptr<int>> map;
    for (uint64_t key = 0; key < 1000; ++key) map.set(key, token);
    PersistentMap<uint64_t, std::shared_ptr<int>> copy = map;
    for (uint64_t key = 0; key < 1000; ++key) map.erase(key);
    EXPECT_EQ(token.use_count(), 1001);
    copy = map;
    EXPECT_EQ(token.use_count(), 1);
    map.set(1, token);
  }
  EXPECT_EQ(token.use_count(), 1);
}

// The writer replaces every value of a generation by the next; a reader must never see two generations in one copy.
TEST(PersistentMapTest, ReadersOfCopiesNeverSeeTheWriter) {
  constexpr uint64_t kKeys = 500;
  using Map = PersistentMap<uint64_t, uint64_t>;
  std::mutex mutex;
  auto published = std::make_shared<const Map>();
  std::atomic<bool> done{false};
  std::atomic<int> reads{0};
  const auto pin = [&] {
    const std::lock_guard lock(mutex);
    return published;
  };
  const auto read = [&] {
    uint64_t last = 0;
    while (!done.load()) {
      const std::shared_ptr<const Map> map = pin();
      if (map->empty()) continue;
      const uint64_t generation = *map->find(0);
      EXPECT_GE(generation, last);
      map->for_each([&](uint64_t, uint64_t value) { EXPECT_EQ(value, generation); });
      last = generation;
      ++reads;
    }
  };
  std::thread first(read), second(read);
  Map map;
  for (uint64_t generation = 1; generation <= static_cast<uint64_t>(100 * kScale) || reads.load() < 200; ++generation) {
    for (uint64_t key = 0; key < kKeys; ++key) {
      if (key != 0 && generation % 7 == 0) map.erase(key);
      map.set(key, generation);
    }
    auto next = std::make_shared<const Map>(map);
    const std::lock_guard lock(mutex);
    published.swap(next);  // the map before may die here or in a reader
  }
  done.store(true);
  first.join();
  second.join();
  EXPECT_EQ(published->size(), kKeys);
}

TEST(PersistentMapTest, WhatIsApartIsWhatWasWrittenSince) {
  PersistentMap<uint64_t, uint64_t> map;
  for (uint64_t key = 0; key < 1000; ++key) map.set(key, 1);
  const auto before = map.snapshot();
  EXPECT_EQ(before.bytes_apart_from(map), 0u);
  map.set(500, 2);
  EXPECT_GT(before.bytes_apart_from(map), 0u);
  EXPECT_LT(before.bytes_apart_from(map) * 10, before.bytes_apart_from({}));
}

}  // namespace
}  // namespace locus
