#include "server/cluster/membership.h"

#include <gmock/gmock.h>

#include <memory>

#include "tests/support/engine_link.h"
#include "tests/support/random.h"
#include "tests/support/simulated_engine.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::CallFate;
using test::EngineLink;

// One membership whose beats the test makes, and other members that beat only if the test says so.
class MembershipTest : public ::testing::Test {
 protected:
  MembershipTest() {
    link_ = std::make_unique<EngineLink>(
        engine_, [this](test::CallKind) { return fate_; }, [](const std::function<void()>&) {},
        [this](test::CallKind, CallFate) { now_ += call_time_; });
    membership_ = std::make_unique<Membership>(*link_, Membership::Options{{"host:1", "", ""},
                                                                           [] { return uint64_t{7}; },
                                                                           [this] { ++changes_; },
                                                                           [this] { return now_; },
                                                                           [this] { return random_.next(); },
                                                                           {}});
    membership_->step();
    membership_->step();
  }
  // Beats once a second for a time; `others` beat too.
  void run(int64_t beats, const std::vector<MemberId>& others = {}) {
    for (int64_t beat = 0; beat < beats; ++beat) {
      now_ += seconds(1);
      for (const MemberId id : others) ASSERT_TRUE(engine_.beat(id, 0, 0).ok());
      membership_->step();
    }
  }
  // Lets a member join right after this one on the ring.
  MemberId add_neighbour(uint64_t distance = 1) {
    const MemberId id = (membership_->self().id + distance) % kMaxMemberId;
    EXPECT_TRUE(engine_.join(id, {}, 0).ok());
    return id;
  }

  test::SimulatedEngine engine_;
  ClusterTime now_{seconds(1000)};
  CallFate fate_ = CallFate::kAnswered;
  ClusterTiming::Duration call_time_ = milliseconds(1);
  test::Random random_{1};
  int changes_ = 0;
  std::unique_ptr<EngineLink> link_;
  std::unique_ptr<Membership> membership_;
};

TEST_F(MembershipTest, TheFirstStepsJoinAndBeat) {
  const Membership::Self self = membership_->self();
  EXPECT_TRUE(engine_.lives(self.id));
  EXPECT_TRUE(self.lease->living());
  EXPECT_EQ(engine_.members()->front().load, 7u);
  EXPECT_TRUE(membership_->sweeps()) << "alone";
}

TEST_F(MembershipTest, TheLeaseIsCountedFromBeforeTheBeatWasSent) {
  call_time_ = seconds(2);
  now_ += seconds(1);
  const ClusterTime sent = now_;
  membership_->step();
  EXPECT_EQ(membership_->self().lease->expires(), sent + ClusterTiming().lease);
}

TEST_F(MembershipTest, TheNextBeatIsDueASecondAfterTheLastOne) {
  const ClusterTime sent = now_;
  const ClusterTime next = membership_->step();
  EXPECT_GE(next, sent + ClusterTiming().beat);
  EXPECT_LE(next, sent + ClusterTiming().beat + ClusterTiming().jitter);
}

TEST_F(MembershipTest, ALostAnswerDoesNotExtendTheLease) {
  const ClusterTime expires = membership_->self().lease->expires();
  fate_ = CallFate::kLost;
  run(3);
  EXPECT_EQ(membership_->self().lease->expires(), expires);
  EXPECT_FALSE(membership_->engine_answers());
}

TEST_F(MembershipTest, ASilentMemberIsSuspectedAfterSixSeconds) {
  const MemberId silent = add_neighbour(), beating = add_neighbour(2);
  run(6, {beating});
  EXPECT_FALSE(membership_->suspect(now_).has_value());
  run(1, {beating});
  ASSERT_TRUE(membership_->suspect(now_).has_value());
  EXPECT_EQ(membership_->suspect(now_)->id, silent);
  membership_->suspect_answered(silent, true, now_);
  EXPECT_FALSE(membership_->suspect(now_).has_value());
  EXPECT_EQ(membership_->take_noticed_dead(), std::vector<MemberId>{silent});
  EXPECT_EQ(membership_->responsibility(now_), std::nullopt) << "the followers come first";
  EXPECT_EQ(membership_->responsibility(now_ + ClusterTiming().others_wait), silent);
}

TEST_F(MembershipTest, AnEngineThatIsAwayKillsNobody) {
  add_neighbour();
  run(3);
  fate_ = CallFate::kNever;
  run(30);
  fate_ = CallFate::kAnswered;
  run(6);
  EXPECT_FALSE(membership_->suspect(now_).has_value()) << "counted from the first beat that succeeded";
  run(1);
  EXPECT_TRUE(membership_->suspect(now_).has_value());
}

TEST_F(MembershipTest, ARunOfSilentNeighboursIsWatchedBeforeTheFirstIsDead) {
  for (uint64_t distance = 1; distance <= 9; ++distance) add_neighbour(distance);
  run(10);
  // The first three were watched at once, six more since they were quiet.
  std::vector<MemberId> dead;
  while (const auto suspect = membership_->suspect(now_)) {
    dead.push_back(suspect->id);
    membership_->suspect_answered(suspect->id, true, now_);
  }
  EXPECT_EQ(dead.size(), 9u);
}

TEST_F(MembershipTest, AMemberThatIsDeclaredDeadEndsItsLeaseAndJoinsAnew) {
  const Membership::Self before = membership_->self();
  ASSERT_TRUE(engine_.leave(before.id).ok());
  changes_ = 0;
  run(1);
  EXPECT_TRUE(before.lease->ended());
  EXPECT_EQ(membership_->self().id, 0u);
  EXPECT_EQ(changes_, 1);
  run(2);
  EXPECT_NE(membership_->self().id, before.id);
  EXPECT_TRUE(engine_.lives(membership_->self().id));
  EXPECT_FALSE(before.lease->living());
}

TEST_F(MembershipTest, APausedMemberClaimsNothingWhenItWakes) {
  const Membership::Self before = membership_->self();
  now_ += seconds(20);
  EXPECT_FALSE(before.lease->living());
  EXPECT_FALSE(membership_->engine_answers());
  ASSERT_TRUE(engine_.mark_dead({before.id, 1}).value());
  run(1);
  EXPECT_TRUE(before.lease->ended());
}

TEST_F(MembershipTest, AJoinWithoutAnswerIsRepeatedWithTheSameId) {
  ASSERT_TRUE(engine_.leave(membership_->self().id).ok());
  run(1);
  fate_ = CallFate::kLost;
  run(3);
  fate_ = CallFate::kAnswered;
  run(2);
  EXPECT_EQ(engine_.living(), 1u);
}

TEST_F(MembershipTest, AMemberThatLeftDoesNotBeat) {
  const Membership::Self before = membership_->self();
  EXPECT_EQ(membership_->leave(), before.id);
  EXPECT_TRUE(before.lease->ended());
  EXPECT_EQ(membership_->step(), ClusterTime::max());
  EXPECT_TRUE(membership_->self().left);
}

TEST_F(MembershipTest, AMemberThatTakesNoScenesSaysSo) {
  membership_->take_no_scenes();
  run(1);
  EXPECT_EQ(engine_.members()->front().load, kTakesNoScenes);
}

}  // namespace
}  // namespace locus::server
