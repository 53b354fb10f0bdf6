#include "server/cluster/led_scenes.h"

#include <gmock/gmock.h>

#include <memory>

namespace locus::server {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::UnorderedElementsAre;

LeaderRow led_row(SceneKey key, Token token) { return {key, 1, token, 0, 1}; }

class LedScenesTest : public ::testing::Test {
 protected:
  std::shared_ptr<MemberLease> member_ = std::make_shared<MemberLease>([] { return ClusterTime(); });
  LedScenes led_;
};

TEST_F(LedScenesTest, AStoppedSceneIsRemovedAndItsLeaseStopsAtOnce) {
  const auto lease = led_.start(led_row(5, 3), member_).lease;
  EXPECT_EQ(led_.find(5), lease);
  EXPECT_FALSE(led_.stop(5, 2, StopReason::kFenced)) << "another token";
  EXPECT_TRUE(led_.stop(5, 3, StopReason::kFenced));
  EXPECT_EQ(lease->state(), SceneLease::State::kStopped);
  EXPECT_EQ(led_.find(5), nullptr);
  const auto stopped = led_.take_stopped();
  ASSERT_THAT(stopped, SizeIs(1));
  EXPECT_EQ(stopped[0].token, 3u);
  EXPECT_THAT(led_.take_stopped(), IsEmpty());
}

TEST_F(LedScenesTest, OnlyAHigherTokenReplacesALease) {
  const auto lease = led_.start(led_row(5, 3), member_).lease;
  EXPECT_EQ(led_.start(led_row(5, 3), member_).lease, nullptr);
  EXPECT_EQ(led_.start(led_row(5, 2), member_).lease, nullptr);
  const LedScenes::Started started = led_.start(led_row(5, 4), member_);
  EXPECT_NE(started.lease, nullptr);
  EXPECT_EQ(lease->state(), SceneLease::State::kStopped);
  EXPECT_THAT(started.before, SizeIs(1));
  EXPECT_THAT(led_.take_stopped(), IsEmpty());
}

// Another thread may stop the scene before the host is told that it started.
TEST_F(LedScenesTest, AStopOfTheNewLeaseIsNotAmongTheStopsBeforeItsStart) {
  led_.start(led_row(5, 3), member_);
  EXPECT_TRUE(led_.stop(5, 3, StopReason::kFenced));
  const LedScenes::Started again = led_.start(led_row(5, 3), member_);
  EXPECT_TRUE(led_.stop(5, 3, StopReason::kFenced));
  EXPECT_THAT(again.before, SizeIs(1));
  EXPECT_THAT(led_.take_stopped(), SizeIs(1));
}

TEST_F(LedScenesTest, ARaisedTokenContinuesTheLease) {
  const auto lease = led_.start(led_row(5, 3), member_).lease;
  EXPECT_FALSE(led_.raise(5, 2, 3));
  EXPECT_FALSE(led_.raise(6, 3, 4));
  EXPECT_TRUE(led_.raise(5, 3, 4));
  EXPECT_EQ(lease->token(), 4u);
  EXPECT_NE(lease->state(), SceneLease::State::kStopped);
  EXPECT_EQ(led_.start(led_row(5, 4), member_).lease, nullptr) << "it is led with this token";
  EXPECT_FALSE(led_.stop(5, 3, StopReason::kFenced));
  EXPECT_TRUE(led_.stop(5, 4, StopReason::kFenced));
  EXPECT_FALSE(led_.raise(5, 4, 5));
  EXPECT_EQ(led_.take_stopped()[0].token, 4u);
}

TEST_F(LedScenesTest, ATakenSceneHasNoStopForTheHost) {
  const auto lease = led_.start(led_row(5, 3), member_).lease;
  EXPECT_EQ(led_.take(5), 3u);
  EXPECT_EQ(led_.take(5), std::nullopt);
  EXPECT_EQ(lease->state(), SceneLease::State::kStopped);
  EXPECT_THAT(led_.take_stopped(), IsEmpty());
}

TEST_F(LedScenesTest, AllScenesStopTogether) {
  led_.start(led_row(5, 3), member_);
  led_.start(led_row(6, 1), member_);
  EXPECT_THAT(led_.keys(), UnorderedElementsAre(5, 6));
  led_.stop_all(StopReason::kDeclaredDead);
  EXPECT_EQ(led_.size(), 0u);
  EXPECT_THAT(led_.take_stopped(), SizeIs(2));
}

}  // namespace
}  // namespace locus::server
