// Tests Leases: who owns an object, and the tables of snapshots.
#include "core/scene/objects/leases.h"

#include <gmock/gmock.h>

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

std::vector<uint32_t> handles_of(const Leases& leases, uint64_t writer) {
  std::vector<uint32_t> handles;
  leases.for_each(writer, [&handles](uint32_t handle) { handles.push_back(handle); });
  return handles;
}

TEST(LeasesTest, AnObjectBelongsToTheWriterThatItWasGivenToLast) {
  Leases leases;
  leases.begin(7, 100);
  leases.begin(9, 200);
  leases.give(3, 7);
  leases.give(4, 7);
  leases.give(3, 9);
  leases.give(4, 0);
  leases.give(5, 7);
  EXPECT_THAT(handles_of(leases, 7), ElementsAre(5));
  EXPECT_THAT(handles_of(leases, 9), ElementsAre(3));
  EXPECT_EQ(leases.owner(3), 9u);
  EXPECT_EQ(leases.owner(4), 0u);
  EXPECT_EQ(leases.owner(1000), 0u);
}

TEST(LeasesTest, ChangesCountBeginningsLengthsAndEnds) {
  Leases leases;
  leases.begin(7, 100);
  EXPECT_EQ(leases.changes(), 1u);
  leases.begin(7, 100);
  EXPECT_EQ(leases.changes(), 1u);
  leases.begin(7, 50);
  leases.begin(3, 1);
  EXPECT_EQ(leases.changes(), 3u);
  EXPECT_THAT(leases.list(), ElementsAre(Lease{3, 1}, Lease{7, 50}));
  leases.end(7);
  leases.end(7);
  EXPECT_EQ(leases.changes(), 4u);
  EXPECT_FALSE(leases.has(7));
  EXPECT_TRUE(leases.has(3));
}

TEST(LeasesTest, ATableDoesNotSeeLaterChanges) {
  Leases leases;
  leases.begin(7, 100);
  leases.give(1, 7);
  leases.give(2, 7);
  const LeaseTable table = leases.table();
  leases.give(1, 0);
  leases.give(2, 0);
  leases.end(7);
  EXPECT_THAT(handles_of(leases, 7), IsEmpty());
  EXPECT_THAT(table.leases, ElementsAre(Lease{7, 100}));
  std::vector<uint32_t> handles;
  table.objects.for_each(7, [&handles](uint32_t handle) {
    handles.push_back(handle);
    return true;
  });
  EXPECT_THAT(handles, UnorderedElementsAre(1, 2));
}

}  // namespace
}  // namespace locus::test
