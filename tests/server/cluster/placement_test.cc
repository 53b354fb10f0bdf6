#include "server/cluster/placement.h"

#include <gmock/gmock.h>

#include <map>
#include <vector>

#include "tests/support/random.h"

namespace locus::server {
namespace {

using ::testing::AnyOf;

MemberRow placement_row(MemberId id, uint64_t load) {
  MemberRow row;
  row.id = id;
  row.load = load;
  return row;
}

class PlacementTableTest : public ::testing::Test {
 protected:
  std::optional<MemberId> choose(MemberId excluded = 0, uint64_t load = 0) {
    return table_.choose([this] { return random_.next(); }, excluded, load);
  }

  PlacementTable table_;
  test::Random random_{1};
};

TEST_F(PlacementTableTest, TheLessLoadedOfTwoIsChosen) {
  table_.update(std::vector<MemberRow>{placement_row(1, 100), placement_row(2, 5)}, ClusterTime());
  for (int i = 0; i < 20; ++i) EXPECT_EQ(choose(), 2u);
}

TEST_F(PlacementTableTest, EachMemberButTheMostLoadedOneIsChosenSometimes) {
  std::vector<MemberRow> rows;
  for (MemberId id = 1; id <= 5; ++id) rows.push_back(placement_row(id, id));
  table_.update(rows, ClusterTime());
  std::map<MemberId, int> chosen;
  for (int i = 0; i < 1000; ++i) ++chosen[*choose()];
  EXPECT_EQ(chosen[5], 0);
  for (MemberId id = 1; id < 5; ++id) EXPECT_GT(chosen[id], 0) << id;
}

TEST_F(PlacementTableTest, ChoicesCountUntilTheTableIsReadAgain) {
  table_.update(std::vector<MemberRow>{placement_row(1, 0), placement_row(2, 5)}, ClusterTime());
  EXPECT_EQ(choose(0, 10), 1u);
  EXPECT_EQ(choose(0, 10), 2u);
  EXPECT_EQ(choose(0, 10), 1u);
}

TEST_F(PlacementTableTest, MembersOfEqualLoadTakeTurns) {
  table_.update(std::vector<MemberRow>{placement_row(1, 5), placement_row(2, 5)}, ClusterTime());
  std::map<MemberId, int> chosen;
  for (int i = 0; i < 10; ++i) ++chosen[*choose()];
  EXPECT_EQ(chosen[1], 5);
}

TEST_F(PlacementTableTest, DeadDrainingAndExcludedMembersAreNotChosen) {
  std::vector<MemberRow> rows = {placement_row(1, 5), placement_row(2, kTakesNoScenes), placement_row(3, 1),
                                 placement_row(4, 9)};
  rows[2].dead = true;
  table_.update(rows, ClusterTime());
  for (int i = 0; i < 20; ++i) EXPECT_EQ(choose(1), 4u);
  table_.remove(4);
  EXPECT_EQ(choose(1), std::nullopt);
  EXPECT_EQ(choose(), 1u);
}

TEST_F(PlacementTableTest, TheLeastLoadedFollowerIsChosenIfAnyTakesScenes) {
  table_.update(std::vector<MemberRow>{placement_row(1, 5), placement_row(2, 3), placement_row(3, 1)}, ClusterTime());
  EXPECT_EQ(table_.choose_of(std::vector<MemberId>{1, 2, 9}), 2u);
  EXPECT_EQ(table_.choose_of(std::vector<MemberId>{9}), std::nullopt);
}

TEST_F(PlacementTableTest, ATableIsFreshForItsAge) {
  const ClusterTime read{std::chrono::seconds(10)};
  EXPECT_FALSE(table_.fresh(read, std::chrono::seconds(2)));
  table_.update({}, read);
  EXPECT_TRUE(table_.fresh(read + std::chrono::seconds(2), std::chrono::seconds(2)));
  EXPECT_FALSE(table_.fresh(read + std::chrono::seconds(3), std::chrono::seconds(2)));
  table_.expire();
  EXPECT_FALSE(table_.fresh(read, std::chrono::seconds(2)));
}

}  // namespace
}  // namespace locus::server
