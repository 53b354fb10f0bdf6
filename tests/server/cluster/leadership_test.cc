#include "server/cluster/leadership.h"

#include <gmock/gmock.h>

#include <memory>
#include <optional>
#include <vector>

#include "tests/support/simulated_cluster.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::SimulatedCluster;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Ge;
using ::testing::IsEmpty;
using ::testing::Le;
using ::testing::SizeIs;
using Daemon = SimulatedCluster::Daemon;

class LeadershipTest : public ::testing::Test {
 protected:
  explicit LeadershipTest(int daemons = 3) {
    for (int i = 0; i < daemons; ++i) {
      Daemon& daemon = cluster_.start(milliseconds(300 * i));
      daemon.load_of_daemon = [&daemon] { return daemon.led().size(); };
      daemons_.push_back(&daemon);
    }
    cluster_.run(seconds(3));
  }
  ~LeadershipTest() override { EXPECT_EQ(cluster_.fault(), ""); }

  // Creates a scene through the first daemon and returns the daemon that leads it.
  Daemon& create(SceneKey key) {
    cluster_.engine().add_scene(key);
    keys_.push_back(key);
    EXPECT_TRUE(daemons_[0]->leadership().place(key).ok());
    cluster_.run(seconds(2));
    return *leader(key);
  }
  // Creates a scene that `daemon` leads, and that the other daemons follow.
  void create_at(Daemon& daemon, SceneKey key) {
    cluster_.engine().add_scene(key);
    keys_.push_back(key);
    ASSERT_TRUE(cluster_.engine().take_over(key, 0, daemon.id()).ok());
    cluster_.run(seconds(2));
    ASSERT_EQ(leader(key), &daemon);
  }
  // Lets a daemon follow a scene, with all of its records.
  void follow(Daemon& daemon, SceneKey key) {
    daemon.followed_of = [this, key](MemberId leader) {
      const LeaderRow row = cluster_.engine().row(key);
      std::vector<ClusterHost::FollowedScene> followed;
      if (row.leader == leader) followed.push_back({key, row.token});
      return followed;
    };
    for (Daemon* other : daemons_)
      other->followers_of = [&daemon](SceneKey) { return std::vector<MemberId>{daemon.id()}; };
  }
  // Returns the daemon that the engine calls the leader, or null.
  Daemon* leader(SceneKey key) {
    for (Daemon* daemon : cluster_.daemons())
      if (daemon->id() != 0 && daemon->id() == cluster_.engine().row(key).leader) return daemon;
    return nullptr;
  }
  // Runs until the scene is led by another daemon than `before`, at most a minute. Returns the time that it took.
  double seconds_until_led_again(SceneKey key, MemberId before) {
    const ClusterTime from = cluster_.now();
    for (int i = 0; i < 6000; ++i) {
      cluster_.run(milliseconds(10));
      Daemon* const now = leader(key);
      if (now != nullptr && now->id() != before && now->led().contains(key)) break;
    }
    return std::chrono::duration<double>(cluster_.now() - from).count();
  }
  std::optional<absl::Status> move(Daemon& from, SceneKey key, MemberId to) {
    const auto result = std::make_shared<std::optional<absl::Status>>();
    cluster_.move(from, key, to, [result](const absl::Status& status) { *result = status; });
    cluster_.run(seconds(5));
    return *result;
  }

  SimulatedCluster cluster_{{}};
  std::vector<Daemon*> daemons_;
  std::vector<SceneKey> keys_;
};

TEST_F(LeadershipTest, ANewSceneIsLedAtOnceByTheMemberThatWasChosen) {
  for (SceneKey key = 1; key <= 9; ++key) create(key);
  EXPECT_EQ(cluster_.unled(keys_), "");
  for (Daemon* daemon : daemons_) EXPECT_THAT(daemon->led(), SizeIs(AllOf(Ge(2), Le(4)))) << "by loads";
  EXPECT_EQ(cluster_.engine().row(1).token, 1u);
}

TEST_F(LeadershipTest, ASceneIsPlacedOnce) {
  create(1);
  EXPECT_EQ(daemons_[1]->leadership().place(1).status().code(), absl::StatusCode::kAborted);
  EXPECT_EQ(daemons_[1]->leadership().place(2).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(LeadershipTest, ASceneWhoseCreatorDiedBeforePlacingItIsPlacedByAnother) {
  cluster_.engine().add_scene(1);
  cluster_.run(seconds(8));
  EXPECT_EQ(cluster_.unled({1}), "");
}

TEST_F(LeadershipTest, FollowersTakeOverAtOnceAndOthersTwoSecondsLater) {
  create_at(*daemons_[0], 1);
  create_at(*daemons_[0], 2);
  follow(*daemons_[1], 1);
  const MemberId dead = daemons_[0]->id();
  cluster_.kill(*daemons_[0]);
  EXPECT_LE(seconds_until_led_again(1, dead), 8.2) << "at most 6 s after a neighbour saw the last beat, and a beat";
  EXPECT_EQ(leader(1), daemons_[1]);
  EXPECT_EQ(leader(2), nullptr);
  EXPECT_LE(seconds_until_led_again(2, dead), 3.2);
  cluster_.run(seconds(1));
  EXPECT_THAT(cluster_.engine().scenes_led_by(dead).value(), IsEmpty());
  EXPECT_EQ(cluster_.engine().living(), 2u);
}

TEST_F(LeadershipTest, AFollowerOfALeaderThatChangedTakesNothing) {
  create_at(*daemons_[0], 1);
  const MemberId first = daemons_[0]->id();
  daemons_[2]->followed_of = [first](MemberId leader) {  // it has not heard that the scene was moved
    std::vector<ClusterHost::FollowedScene> followed;
    if (leader == first) followed.push_back({1, 1});
    return followed;
  };
  for (Daemon* daemon : daemons_)
    daemon->followers_of = [this](SceneKey) { return std::vector<MemberId>{daemons_[1]->id()}; };
  ASSERT_EQ(move(*daemons_[0], 1, daemons_[1]->id()), absl::OkStatus());
  cluster_.kill(*daemons_[0]);
  cluster_.run(seconds(15));
  EXPECT_EQ(leader(1), daemons_[1]);
}

TEST_F(LeadershipTest, APausedLeaderIsFencedAndStopsWhenItWakes) {
  create_at(*daemons_[0], 1);
  follow(*daemons_[1], 1);
  const std::shared_ptr<const SceneLease> lease = daemons_[0]->leadership().find(1);
  ASSERT_TRUE(lease->living());
  cluster_.pause(*daemons_[0], seconds(15));
  cluster_.run(milliseconds(14900));
  EXPECT_FALSE(lease->living()) << "before any thread of it has run";
  EXPECT_EQ(leader(1), daemons_[1]);
  cluster_.run(seconds(5));
  EXPECT_EQ(lease->state(), SceneLease::State::kStopped);
  EXPECT_THAT(daemons_[0]->led(), IsEmpty());
  EXPECT_THAT(daemons_[0]->stops, Contains(StopReason::kDeclaredDead));
  EXPECT_NE(daemons_[0]->id(), 0u) << "it is a member again";
  EXPECT_EQ(leader(1), daemons_[1]);
}

TEST_F(LeadershipTest, AnEngineThatIsAwayMovesNothingAndLeasesExpire) {
  for (SceneKey key = 1; key <= 3; ++key) create(key);
  const std::vector<MemberId> before = {cluster_.engine().row(1).leader, cluster_.engine().row(2).leader};
  const std::shared_ptr<const SceneLease> lease = leader(1)->leadership().find(1);
  cluster_.stop_engine(seconds(60));
  cluster_.run(seconds(59));
  EXPECT_EQ(lease->state(), SceneLease::State::kExpired) << "it still leads, but may claim nothing";
  cluster_.run(seconds(5));
  EXPECT_TRUE(lease->living());
  EXPECT_EQ(cluster_.engine().row(1).leader, before[0]);
  EXPECT_EQ(cluster_.engine().row(2).leader, before[1]);
  for (Daemon* daemon : daemons_) EXPECT_THAT(daemon->stops, IsEmpty());
}

TEST_F(LeadershipTest, ALeaderThatIsCutOffLosesItsScenesAndJoinsAnew) {
  create_at(*daemons_[0], 1);
  const MemberId before = daemons_[0]->id();
  const std::shared_ptr<const SceneLease> lease = daemons_[0]->leadership().find(1);
  cluster_.cut_off(*daemons_[0], seconds(20));
  cluster_.run(seconds(10));
  EXPECT_FALSE(lease->living());
  EXPECT_NE(cluster_.engine().row(1).leader, before);
  cluster_.run(seconds(15));
  EXPECT_NE(daemons_[0]->id(), before);
  EXPECT_EQ(cluster_.unled({1}), "");
}

TEST_F(LeadershipTest, AFencedLeaderStopsAtOnce) {
  create_at(*daemons_[0], 1);
  const std::shared_ptr<const SceneLease> lease = daemons_[0]->leadership().find(1);
  EXPECT_FALSE(daemons_[0]->leadership().fenced(1, 7)) << "another token";
  EXPECT_TRUE(daemons_[0]->leadership().fenced(1, 1));
  EXPECT_EQ(lease->state(), SceneLease::State::kStopped);
  EXPECT_EQ(daemons_[0]->leadership().find(1), nullptr);
  cluster_.run(milliseconds(1));
  EXPECT_THAT(daemons_[0]->stops, Contains(StopReason::kFenced));
}

TEST_F(LeadershipTest, ALeaderThatRaisedItsTokenLeadsOnWithTheSameLease) {
  create_at(*daemons_[0], 1);
  const std::shared_ptr<const SceneLease> lease = daemons_[0]->leadership().find(1);
  ASSERT_TRUE(cluster_.raise_token(*daemons_[0], 1, milliseconds(5)));
  cluster_.run(seconds(12));
  EXPECT_THAT(daemons_[0]->stops, IsEmpty()) << "a comparison found the new token";
  EXPECT_EQ(lease->token(), 2u);
  EXPECT_TRUE(lease->living());
  follow(*daemons_[1], 1);
  EXPECT_EQ(move(*daemons_[0], 1, daemons_[1]->id()), absl::OkStatus()) << "with the new token";
  EXPECT_EQ(leader(1), daemons_[1]);
}

TEST_F(LeadershipTest, ATokenThatAComparisonNoticedFirstIsLedAnew) {
  create_at(*daemons_[0], 1);
  ASSERT_TRUE(cluster_.raise_token(*daemons_[0], 1, milliseconds(500)));
  daemons_[0]->leadership().reconcile_soon();
  cluster_.run(seconds(2));
  EXPECT_EQ(daemons_[0]->stops, std::vector<StopReason>{StopReason::kFenced});
  EXPECT_EQ(cluster_.unled({1}), "");
}

TEST_F(LeadershipTest, ADeletedSceneIsNoticed) {
  create_at(*daemons_[0], 1);
  cluster_.engine().remove_scene(1);
  cluster_.run(seconds(11));
  EXPECT_THAT(daemons_[0]->led(), IsEmpty());
}

TEST_F(LeadershipTest, ADrainHandsScenesToFollowersAndLeaves) {
  create_at(*daemons_[0], 1);
  create_at(*daemons_[0], 2);
  follow(*daemons_[2], 1);
  daemons_[0]->followers_of = [this](SceneKey key) {
    return key == 1 ? std::vector<MemberId>{daemons_[2]->id()} : std::vector<MemberId>();
  };
  cluster_.drain(*daemons_[0]);
  cluster_.run(seconds(2));
  EXPECT_TRUE(daemons_[0]->leadership().drained());
  EXPECT_EQ(leader(1), daemons_[2]);
  EXPECT_EQ(cluster_.unled(keys_), "");
  EXPECT_EQ(daemons_[0]->stops, (std::vector<StopReason>{StopReason::kHandedOver, StopReason::kHandedOver}));
  EXPECT_EQ(cluster_.engine().living(), 2u);
  cluster_.run(seconds(5));
  EXPECT_EQ(daemons_[0]->id(), 0u) << "it does not join again";
}

// Others give scenes to a member that drains until they have seen its beat.
TEST_F(LeadershipTest, ADrainNoticesAllScenesThatWereGivenMeanwhile) {
  create_at(*daemons_[0], 1);
  const MemberId id = daemons_[0]->id();
  for (const SceneKey key : {2, 3}) {
    cluster_.engine().add_scene(key);
    keys_.push_back(key);
  }
  daemons_[0]->followers_of = [&](SceneKey key) {  // called before each hand-over
    if (key < 3 && cluster_.engine().row(key + 1).token == 0) {
      EXPECT_TRUE(cluster_.engine().take_over(key + 1, 0, id).ok());
    }
    return std::vector<MemberId>();
  };
  cluster_.drain(*daemons_[0]);
  for (int i = 0; i < 500 && !daemons_[0]->leadership().drained(); ++i) cluster_.run(milliseconds(10));
  EXPECT_TRUE(daemons_[0]->leadership().drained());
  EXPECT_THAT(cluster_.engine().scenes_led_by(id).value(), IsEmpty());
  EXPECT_THAT(daemons_[0]->stops, SizeIs(3));
  cluster_.run(seconds(2));
  EXPECT_EQ(cluster_.unled(keys_), "");
}

TEST_F(LeadershipTest, TheLastMemberReleasesItsScenesAndTheNextOneLeadsThem) {
  create(1);
  for (Daemon* daemon : daemons_) cluster_.drain(*daemon);
  cluster_.run(seconds(8));
  for (Daemon* daemon : daemons_) EXPECT_TRUE(daemon->leadership().drained());
  cluster_.start();
  cluster_.run(seconds(12));
  EXPECT_EQ(cluster_.unled({1}), "");
}

TEST_F(LeadershipTest, AMoveGoesToAFollowerWithAllRecords) {
  create_at(*daemons_[0], 1);
  EXPECT_EQ(move(*daemons_[1], 1, daemons_[2]->id())->code(), absl::StatusCode::kNotFound) << "not the leader";
  follow(*daemons_[1], 1);
  EXPECT_EQ(move(*daemons_[0], 1, daemons_[2]->id())->code(), absl::StatusCode::kFailedPrecondition) << "no follower";
  EXPECT_EQ(move(*daemons_[0], 1, daemons_[1]->id()), absl::OkStatus());
  EXPECT_EQ(leader(1), daemons_[1]);
  EXPECT_EQ(cluster_.unled({1}), "");
}

TEST_F(LeadershipTest, ASceneWithoutFollowersMovesToAnyLivingMember) {
  create_at(*daemons_[0], 1);
  EXPECT_EQ(move(*daemons_[0], 1, daemons_[2]->id()), absl::OkStatus());
  EXPECT_EQ(leader(1), daemons_[2]);
  EXPECT_EQ(cluster_.unled({1}), "");
}

TEST_F(LeadershipTest, AMoveToNoMemberIsRefusedAndChangesNothing) {
  create_at(*daemons_[0], 1);
  follow(*daemons_[1], 1);
  EXPECT_EQ(move(*daemons_[0], 1, 0)->code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(leader(1), daemons_[0]);
  EXPECT_THAT(daemons_[0]->stops, IsEmpty());
}

TEST_F(LeadershipTest, AMoveToTheLeaderItselfChangesNothing) {
  create_at(*daemons_[0], 1);
  follow(*daemons_[0], 1);  // as a host might say of its own scene
  EXPECT_EQ(move(*daemons_[0], 1, daemons_[0]->id()), absl::OkStatus());
  EXPECT_EQ(cluster_.engine().row(1).token, 1u);
  EXPECT_THAT(daemons_[0]->stops, IsEmpty());
}

TEST_F(LeadershipTest, AMoveWhileTheEngineIsAwayIsRefusedAndChangesNothing) {
  create_at(*daemons_[0], 1);
  follow(*daemons_[1], 1);
  cluster_.stop_engine(seconds(30));
  cluster_.run(seconds(10));
  EXPECT_EQ(move(*daemons_[0], 1, daemons_[1]->id())->code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(daemons_[0]->stops, IsEmpty());
  cluster_.run(seconds(25));
  EXPECT_EQ(leader(1), daemons_[0]);
}

TEST_F(LeadershipTest, AMoveToAMemberThatDiedIsUndone) {
  create_at(*daemons_[0], 1);
  follow(*daemons_[1], 1);
  const MemberId to = daemons_[1]->id();
  daemons_[0]->followers_of = [to](SceneKey) { return std::vector<MemberId>{to}; };
  cluster_.kill(*daemons_[1]);
  ASSERT_TRUE(cluster_.engine().leave(to).ok());
  EXPECT_EQ(move(*daemons_[0], 1, to)->code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(leader(1), daemons_[0]);
  EXPECT_EQ(cluster_.unled({1}), "") << "it leads again, with the same token";
  EXPECT_EQ(cluster_.engine().row(1).token, 1u);
}

TEST_F(LeadershipTest, AClusterThatWasKilledAsAWholeRecovers) {
  for (SceneKey key = 1; key <= 6; ++key) create(key);
  for (Daemon* daemon : cluster_.daemons()) cluster_.kill(*daemon);
  cluster_.run(seconds(5));
  for (int i = 0; i < 3; ++i) cluster_.start();
  cluster_.run(seconds(15));
  EXPECT_EQ(cluster_.unled(keys_), "");
  EXPECT_EQ(cluster_.engine().living(), 3u);
}

// Three daemons with many scenes: the row of 1,000 scenes, of which one daemon is killed.
TEST_F(LeadershipTest, AThousandScenesOfThreeDaemonsAreLedAgainInFifteenSeconds) {
  for (SceneKey key = 1; key <= 1000; ++key) {
    cluster_.engine().add_scene(key);
    keys_.push_back(key);
    ASSERT_TRUE(daemons_[0]->leadership().place(key).ok());
  }
  cluster_.run(seconds(5));
  ASSERT_EQ(cluster_.unled(keys_), "");
  cluster_.kill(*daemons_[1]);
  cluster_.run(seconds(15));
  EXPECT_EQ(cluster_.unled(keys_), "");
}

}  // namespace
}  // namespace locus::server
