// Tests of the contract of ClusterEngine, for each of its implementations: a test file includes this header and
// instantiates the suite with a function that makes an empty engine.
#ifndef LOCUS_TESTS_SUPPORT_CLUSTER_ENGINE_JUDGE_H_
#define LOCUS_TESTS_SUPPORT_CLUSTER_ENGINE_JUDGE_H_

#include <gmock/gmock.h>

#include <atomic>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "server/cluster/cluster_engine.h"

namespace locus::test {

// An engine without members and scenes.
class EngineUnderTest {
 public:
  virtual ~EngineUnderTest() = default;
  virtual server::ClusterEngine& engine() = 0;
  // Adds a scene that never had a leader, and returns its key.
  virtual SceneKey add_scene() = 0;
};

class ClusterEngineJudge : public ::testing::TestWithParam<std::function<std::unique_ptr<EngineUnderTest>()>> {
 protected:
  using Code = absl::StatusCode;

  server::ClusterEngine& engine() { return tested_->engine(); }
  // Adds members with these ids.
  void join(std::vector<server::MemberId> ids) {
    for (const server::MemberId id : ids) ASSERT_TRUE(engine().join(id, {"host:1", "zone", "1"}, 10 * id).ok());
  }
  server::BeatReply beat(server::MemberId id, size_t watched = 3) {
    return engine().beat(id, 10 * id, watched).value();
  }
  void kill(server::MemberId id) { ASSERT_TRUE(engine().leave(id).ok()); }
  static std::vector<server::MemberId> ids(const std::vector<server::SeenBeat>& beats) {
    std::vector<server::MemberId> ids;
    for (const server::SeenBeat& seen : beats) ids.push_back(seen.id);
    return ids;
  }
  static std::vector<SceneKey> keys(const absl::StatusOr<std::vector<server::LeaderRow>>& rows) {
    std::vector<SceneKey> keys;
    for (const server::LeaderRow& row : rows.value()) keys.push_back(row.key);
    return keys;
  }
  SceneKey add_scene() { return tested_->add_scene(); }
  // Returns the token of a scene that one of these members leads; 0 if none does.
  server::Token token_of(SceneKey scene) {
    for (const server::MemberId id : {10, 20, 30, 40}) {
      const absl::StatusOr<std::vector<server::LeaderRow>> rows = engine().scenes_led_by(id);
      for (const server::LeaderRow& row : rows.value())
        if (row.key == scene) return row.token;
    }
    return 0;
  }

 private:
  const std::unique_ptr<EngineUnderTest> tested_ = GetParam()();
};

TEST_P(ClusterEngineJudge, ABeatReturnsTheNextLivingMembersOfTheRing) {
  join({10, 20, 30, 40, 50});
  beat(40);
  const server::BeatReply reply = beat(30);
  EXPECT_THAT(ids(reply.next), ::testing::ElementsAre(40, 50, 10));
  EXPECT_EQ(reply.next[0].beat, 1u);
  EXPECT_EQ(reply.next[1].beat, 0u);
  EXPECT_THAT(reply.dead, ::testing::IsEmpty());
  kill(50);
  EXPECT_THAT(ids(beat(30, 10).next), ::testing::ElementsAre(40, 10, 20));
  EXPECT_THAT(beat(30).dead, ::testing::ElementsAre(50));
}

TEST_P(ClusterEngineJudge, JoiningAgainChangesNothing) {
  join({10, 20});
  beat(10);
  join({10});
  EXPECT_EQ(beat(20).next[0].beat, 1u);
  kill(10);
  join({10});
  EXPECT_EQ(engine().beat(10, 0, 3).status().code(), Code::kNotFound);
}

TEST_P(ClusterEngineJudge, AMemberIsMarkedDeadOnlyWithItsPresentBeat) {
  join({10, 20});
  beat(10);
  EXPECT_EQ(engine().mark_dead({10, 0}).value(), false);
  EXPECT_EQ(beat(20).next.size(), 1u);
  EXPECT_EQ(engine().mark_dead({10, 1}).value(), true);
  EXPECT_EQ(engine().mark_dead({10, 1}).value(), true) << "again";
  EXPECT_EQ(engine().beat(10, 0, 3).status().code(), Code::kNotFound);
  EXPECT_THAT(beat(20).dead, ::testing::ElementsAre(10));
}

TEST_P(ClusterEngineJudge, OnlyADeadMemberWithoutScenesIsForgotten) {
  join({10, 20});
  const SceneKey scene = add_scene();
  ASSERT_TRUE(engine().take_over(scene, 0, 10).ok());
  EXPECT_EQ(engine().forget(10).code(), Code::kFailedPrecondition) << "it is living";
  kill(10);
  EXPECT_EQ(engine().forget(10).code(), Code::kFailedPrecondition) << "it leads a scene";
  ASSERT_TRUE(engine().take_over(scene, 1, 20).ok());
  EXPECT_TRUE(engine().forget(10).ok());
  EXPECT_TRUE(engine().forget(10).ok()) << "again";
  join({10});  // a statement that was thought lost may arrive now
  EXPECT_THAT(beat(20).dead, ::testing::IsEmpty());
  EXPECT_EQ(engine().beat(10, 0, 3).status().code(), Code::kNotFound);
}

TEST_P(ClusterEngineJudge, MembersAreTheLivingOnesWithTheirLoads) {
  join({10, 20, 30});
  kill(20);
  ASSERT_TRUE(engine().beat(30, 7, 3).ok());
  const std::vector<server::MemberRow> members = engine().members().value();
  ASSERT_EQ(members.size(), 2u);
  for (const server::MemberRow& member : members) {
    EXPECT_EQ(member.load, member.id == 10 ? 100u : 7u);
    EXPECT_EQ(member.info.address, "host:1");
    EXPECT_FALSE(member.dead);
  }
}

TEST_P(ClusterEngineJudge, ATakeoverNeedsTheTokenAndALivingMember) {
  join({10, 20});
  const SceneKey scene = add_scene();
  const server::LeaderRow row = engine().take_over(scene, 0, 10).value();
  EXPECT_EQ(row.key, scene);
  EXPECT_EQ(row.leader, 10u);
  EXPECT_EQ(row.token, 1u);
  EXPECT_EQ(engine().take_over(scene, 0, 20).status().code(), Code::kAborted);
  EXPECT_EQ(engine().take_over(scene, 2, 20).status().code(), Code::kAborted);
  EXPECT_EQ(engine().take_over(scene + 1000, 1, 20).status().code(), Code::kNotFound);
  kill(20);
  EXPECT_EQ(engine().take_over(scene, 1, 20).status().code(), Code::kFailedPrecondition);
  EXPECT_EQ(engine().take_over(scene, 0, 20).status().code(), Code::kAborted) << "the token comes first";
  EXPECT_EQ(engine().take_over(scene, 1, 77).status().code(), Code::kFailedPrecondition);
  EXPECT_THAT(keys(engine().scenes_led_by(10)), ::testing::ElementsAre(scene));
}

TEST_P(ClusterEngineJudge, AHandOverNeedsTheTokenTheLeaderAndALivingMember) {
  join({10, 20});
  const SceneKey scene = add_scene();
  ASSERT_TRUE(engine().take_over(scene, 0, 10).ok());
  EXPECT_EQ(engine().hand_over(scene, 1, 20, 10).status().code(), Code::kAborted);
  EXPECT_EQ(engine().hand_over(scene, 0, 10, 20).status().code(), Code::kAborted);
  EXPECT_EQ(engine().hand_over(scene, 1, 10, 77).status().code(), Code::kFailedPrecondition);
  EXPECT_EQ(engine().hand_over(scene, 1, 10, 20).value().token, 2u);
  EXPECT_EQ(engine().hand_over(scene, 1, 10, 20).status().code(), Code::kAborted) << "again";
  const server::LeaderRow row = engine().hand_over(scene, 2, 20, 0).value();
  EXPECT_EQ(row.leader, 0u);
  EXPECT_EQ(row.token, 3u);
}

TEST_P(ClusterEngineJudge, ABeatReturnsHowManyScenesWereGivenToTheMember) {
  join({10, 20});
  const SceneKey scene = add_scene();
  EXPECT_EQ(beat(10).assigned, 0u);
  ASSERT_TRUE(engine().take_over(scene, 0, 10).ok());
  EXPECT_EQ(beat(10).assigned, 1u);
  EXPECT_FALSE(engine().take_over(scene, 0, 10).ok());
  EXPECT_EQ(beat(10).assigned, 1u);
  ASSERT_TRUE(engine().hand_over(scene, 1, 10, 20).ok());
  EXPECT_EQ(beat(10).assigned, 1u);
  EXPECT_EQ(beat(20).assigned, 1u);
}

TEST_P(ClusterEngineJudge, ScenesWithoutALeaderAreThoseOfNoMember) {
  join({10, 20});
  const SceneKey first = add_scene(), second = add_scene(), third = add_scene();
  ASSERT_TRUE(engine().take_over(first, 0, 10).ok());
  ASSERT_TRUE(engine().take_over(second, 0, 20).ok());
  kill(20);
  EXPECT_THAT(keys(engine().scenes_without_leader()), ::testing::ElementsAre(third));
  ASSERT_TRUE(engine().hand_over(first, 1, 10, 0).ok());
  EXPECT_THAT(keys(engine().scenes_without_leader()), ::testing::UnorderedElementsAre(first, third));
}

// One of many threads wins each token: tokens are dense, and the engine counts each success.
TEST_P(ClusterEngineJudge, RacingTakeoversWinEachTokenOnce) {
  constexpr int kThreads = 4;
  constexpr server::Token kTokens = 50;
  join({10, 20, 30, 40});
  const SceneKey scene = add_scene();
  std::atomic<uint64_t> wins{0};
  std::vector<std::thread> threads;
  for (int number = 0; number < kThreads; ++number)
    threads.emplace_back([&, number] {
      for (server::Token token = 0; token < kTokens; ++token)
        wins += engine().take_over(scene, token, 10 * static_cast<uint64_t>(number + 1)).ok() ? 1 : 0;
    });
  for (std::thread& thread : threads) thread.join();
  uint64_t assigned = 0;
  for (const server::MemberId id : {10, 20, 30, 40}) assigned += beat(id).assigned;
  EXPECT_EQ(wins, assigned);
  EXPECT_EQ(token_of(scene), wins) << "each success raises the token by one";
  EXPECT_LE(wins, kTokens);
  EXPECT_GE(wins, 1u);
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_CLUSTER_ENGINE_JUDGE_H_
