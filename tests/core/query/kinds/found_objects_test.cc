#include "core/query/kinds/found_objects.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/support/random.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// Grid block that contains one object for each of the given ids.
class Block {
 public:
  explicit Block(const std::vector<Id>& ids) : block_(static_cast<uint32_t>(ids.size()), false) {
    const locus::internal::GridBlock::Places places(block_, {});
    for (uint32_t slot = 0; slot < ids.size(); ++slot) {
      GridEntry entry;
      entry.id = ids[slot];
      places.put(slot, entry, {}, slot, 0);
    }
  }

  void offer_all(FoundObjects& found) const {
    for (uint32_t slot = 0; slot < block_.count(); ++slot) found.offer(GridRef(block_, slot, 0));
  }

 private:
  locus::internal::GridBlock block_;
};

std::vector<Id> ids_of(absl::Span<const FoundObject> objects) {
  std::vector<Id> ids;
  for (const FoundObject& one : objects) {
    EXPECT_EQ(one.object.entry().id, one.id);
    ids.push_back(one.id);
  }
  return ids;
}

void expect_in_order(std::vector<Id> ids) {
  const Block block(ids);
  FoundObjects found;
  found.restart(ids.size());
  block.offer_all(found);
  std::sort(ids.begin(), ids.end());
  EXPECT_EQ(ids_of(found.finish()), ids);
  EXPECT_FALSE(found.truncated());
}

TEST(FoundObjectsTest, ManyObjectsAscendById) {
  Random random(7);
  std::vector<Id> even, uneven;
  for (Id id = 1; id <= 20'000; ++id) {
    even.push_back(id * 5);
    uneven.push_back(id % 2 == 0 ? id : (id << 40));
  }
  random.shuffle(even);
  random.shuffle(uneven);
  expect_in_order(even);
  expect_in_order(uneven);
}

TEST(FoundObjectsTest, WithoutOffersTheResultIsEmpty) {
  FoundObjects found;
  found.restart(10);
  EXPECT_THAT(found.finish(), IsEmpty());
  EXPECT_FALSE(found.truncated());
}

TEST(FoundObjectsTest, IdsAscendForAnyNumberOfObjects) {
  Random random(1);
  for (const uint64_t count : {1, 2, 12, 13, 79, 256, 1024, 1025, 3000}) {
    std::vector<Id> ids;
    for (Id id = 1; id <= count; ++id) ids.push_back(id);
    for (size_t i = ids.size(); i > 1; --i) std::swap(ids[i - 1], ids[random.below(i)]);
    expect_in_order(ids);
  }
}

TEST(FoundObjectsTest, IdsAscendForAnyDistributionOfIds) {
  std::vector<Id> ids = {~Id{0}, 1, Id{1} << 63};
  for (Id id = 100; id > 2; --id) ids.push_back(id);
  expect_in_order(ids);
}

TEST(FoundObjectsTest, OnlyTheLowestIdsAreKept) {
  const Block block({9, 2, 7, 1, 8, 3, 6, 4, 5, 10});
  FoundObjects found;
  found.restart(3);
  block.offer_all(found);
  EXPECT_THAT(ids_of(found.finish()), ElementsAre(1, 2, 3));
  EXPECT_TRUE(found.truncated());
}

TEST(FoundObjectsTest, RestartForgetsEarlierObjects) {
  const Block first({4, 3, 2, 1}), second({5});
  FoundObjects found;
  found.restart(2);
  first.offer_all(found);
  found.restart(2);
  second.offer_all(found);
  EXPECT_THAT(ids_of(found.finish()), ElementsAre(5));
  EXPECT_FALSE(found.truncated());
}

}  // namespace
}  // namespace locus::test
