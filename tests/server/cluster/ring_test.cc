#include "server/cluster/ring.h"

#include <gmock/gmock.h>

#include <vector>

namespace locus::server {
namespace {

using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

ClusterTime ring_time(int64_t s) { return ClusterTime(seconds(1000 + s)); }

BeatReply ring_reply(std::vector<MemberId> next, std::vector<MemberId> dead) {
  BeatReply reply;
  for (const MemberId id : next) reply.next.push_back({id, 1});
  reply.dead = std::move(dead);
  return reply;
}

TEST(RingTest, BetweenGoesAroundTheRing) {
  EXPECT_TRUE(between(10, 15, 20));
  EXPECT_FALSE(between(10, 25, 20));
  EXPECT_FALSE(between(10, 10, 20));
  EXPECT_FALSE(between(10, 20, 20));
  EXPECT_TRUE(between(20, 25, 10));
  EXPECT_TRUE(between(20, 5, 10));
  EXPECT_FALSE(between(20, 15, 10));
  EXPECT_TRUE(between(10, 5, 10));
  EXPECT_FALSE(between(10, 10, 10));
}

TEST(RingTest, EachDeadMemberHasOneResponsibleMember) {
  const std::vector<MemberId> living = {10, 20, 40};
  const std::vector<MemberId> dead = {5, 15, 16, 30, 50};
  for (const MemberId member : dead) {
    int responsible = 0;
    for (size_t i = 0; i < living.size(); ++i) {
      Ring ring;
      ring.update(ring_reply({living[(i + 1) % 3], living[(i + 2) % 3]}, {member}), ring_time(0), ring_time(0));
      responsible += ring.responsibility(living[i], ring_time(0)) == member ? 1 : 0;
    }
    EXPECT_EQ(responsible, 1) << member;
  }
}

TEST(RingTest, AMemberIsResponsibleForTheDeadOnesBeyondADeadNeighbour) {
  Ring ring;
  ring.update(ring_reply({20, 30, 40}, {25}), ring_time(0), ring_time(0));
  EXPECT_EQ(ring.responsibility(10, ring_time(9)), std::nullopt);
  ring.add_dead(20, ring_time(1));
  EXPECT_EQ(ring.next_living(10), 30u);
  EXPECT_EQ(ring.responsibility(10, ring_time(9)), 25u) << "noticed first";
  ring.remove_dead(25);
  EXPECT_EQ(ring.responsibility(10, ring_time(9)), 20u);
}

TEST(RingTest, ResponsibilityBeginsAfterTheTimeOfTheFollowers) {
  Ring ring;
  ring.update(ring_reply({30}, {20}), ring_time(4), ring_time(5));
  EXPECT_EQ(ring.responsibility(10, ring_time(4)), std::nullopt);
  EXPECT_EQ(ring.responsibility(10, ring_time(5)), 20u);
  EXPECT_EQ(ring.first_noticed(10), ring_time(5));
}

TEST(RingTest, DeadMembersAreNoticedOnceAndForgotten) {
  Ring ring;
  ring.update(ring_reply({30}, {20}), ring_time(0), ring_time(0));
  EXPECT_THAT(ring.take_noticed(), ElementsAre(20));
  ring.update(ring_reply({30}, {20}), ring_time(1), ring_time(1));
  EXPECT_THAT(ring.take_noticed(), IsEmpty());
  ring.update(ring_reply({30}, {}), ring_time(2), ring_time(2));
  EXPECT_FALSE(ring.is_dead(20));
}

TEST(RingTest, AMemberThatWasMarkedDuringABeatStaysDead) {
  Ring ring;
  ring.add_dead(20, ring_time(5));
  ring.update(ring_reply({20, 30}, {}), ring_time(4), ring_time(6));
  EXPECT_TRUE(ring.is_dead(20));
  EXPECT_EQ(ring.next_living(10), 30u);
}

TEST(RingTest, TheMemberWithTheLargestIdIsTheLast) {
  Ring ring;
  EXPECT_TRUE(ring.is_last(10)) << "alone";
  ring.update(ring_reply({30}, {}), ring_time(0), ring_time(0));
  EXPECT_FALSE(ring.is_last(10));
  EXPECT_TRUE(ring.is_last(40));
}

}  // namespace
}  // namespace locus::server
