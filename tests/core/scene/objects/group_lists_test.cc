#include "core/scene/objects/group_lists.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tests/support/random.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::set<uint32_t> handles_of(const GroupLists& lists, Group group) {
  std::set<uint32_t> handles;
  lists.for_each(group, [&](uint32_t handle) { return handles.insert(handle).second; });
  return handles;
}

TEST(GroupListsTest, AGroupHasTheHandlesThatWereAddedAndNotRemoved) {
  GroupLists lists;
  EXPECT_EQ(lists.count(7), 0u);
  for (const uint32_t handle : {1, 2, 3}) lists.add(7, handle);
  lists.add(8, 9);
  lists.add(0, 10);
  EXPECT_EQ(lists.count(7), 3u);
  EXPECT_EQ(lists.count(0), 0u);
  lists.remove(7, 2);
  EXPECT_THAT(handles_of(lists, 7), ElementsAre(1, 3));
  EXPECT_THAT(handles_of(lists, 8), ElementsAre(9));
  EXPECT_THAT(handles_of(lists, 0), IsEmpty());
  lists.remove(8, 9);
  EXPECT_EQ(lists.count(8), 0u);
}

TEST(GroupListsTest, AVisitEndsWhenItReturnsFalse) {
  GroupLists lists;
  for (const uint32_t handle : {1, 2, 3}) lists.add(7, handle);
  int visits = 0;
  EXPECT_FALSE(lists.for_each(7, [&](uint32_t) { return ++visits < 2; }));
  EXPECT_EQ(visits, 2);
}

TEST(GroupListsTest, ListsAndTheirSnapshotsEqualAMapAfterRandomChanges) {
  Random random(1);
  GroupLists lists;
  std::map<uint32_t, Group> groups;
  std::vector<std::pair<GroupLists, std::map<uint32_t, Group>>> snapshots;
  const auto check = [](const GroupLists& some, const std::map<uint32_t, Group>& expected) {
    std::map<Group, std::set<uint32_t>> members;
    for (const auto& [handle, group] : expected) members[group].insert(handle);
    for (Group group = 1; group <= 20; ++group) {
      ASSERT_EQ(handles_of(some, group), members[group]);
      ASSERT_EQ(some.count(group), members[group].size());
    }
  };
  for (uint64_t step = 0; step < scaled_count(5000); ++step) {
    const auto handle = static_cast<uint32_t>(random.below(3000));
    if (const auto known = groups.find(handle); known != groups.end()) {
      lists.remove(known->second, handle);
      groups.erase(known);
    } else {
      groups[handle] = 1 + random.below(20);
      lists.add(groups[handle], handle);
    }
    if (step % 500 == 0) snapshots.emplace_back(lists.snapshot(), groups);
  }
  check(lists, groups);
  for (const auto& [snapshot, expected] : snapshots) check(snapshot, expected);
}

}  // namespace
}  // namespace locus::test
