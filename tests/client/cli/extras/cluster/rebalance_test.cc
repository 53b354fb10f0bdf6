#include "client/cli/extras/cluster/rebalance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <string>

#include "absl/strings/str_cat.h"

namespace locus::cli {
namespace {

MemberLoad member_with(const std::string& address, const std::vector<uint64_t>& loads) {
  MemberLoad member{address};
  for (const uint64_t load : loads) member.scenes.push_back({absl::StrCat(address, "-", member.scenes.size()), load});
  return member;
}

// Returns the loads after the moves, and checks that each move takes a scene from where it is.
std::map<std::string, uint64_t> loads_after(const std::vector<MemberLoad>& members,
                                            const std::vector<PlannedMove>& moves) {
  std::map<std::string, uint64_t> loads;
  std::map<std::string, std::string> leaders;
  for (const MemberLoad& member : members) {
    loads[member.address] = load_of(member);
    for (const SceneLoad& scene : member.scenes) leaders[scene.name] = member.address;
  }
  for (const PlannedMove& move : moves) {
    EXPECT_EQ(leaders[move.scene], move.from) << move.scene;
    leaders[move.scene] = move.to;
    loads[move.from] -= move.load;
    loads[move.to] += move.load;
  }
  return loads;
}

TEST(RebalanceTest, ScenesMoveFromTheBusiestMemberUntilItIsNearTheMean) {
  const std::vector<MemberLoad> members = {member_with("a", {1000, 1000, 1000, 1000, 1000, 1000}), member_with("b", {}),
                                           member_with("c", {})};
  const RebalancePlan plan = plan_rebalance(members);
  EXPECT_EQ(plan.busiest_before, 6000u);
  EXPECT_EQ(plan.busiest_after, 2000u);
  EXPECT_EQ(plan.mean, 2000);
  EXPECT_EQ(plan.moves.size(), 4u);
  for (const auto& [address, load] : loads_after(members, plan.moves)) EXPECT_EQ(load, 2000u) << address;
}

TEST(RebalanceTest, BalancedMembersStayAsTheyAre) {
  EXPECT_TRUE(plan_rebalance({member_with("a", {1200}), member_with("b", {800})}).moves.empty())
      << "1.2 times the mean is balanced";
  EXPECT_EQ(plan_rebalance({member_with("a", {700, 600}), member_with("b", {700})}).moves.size(), 0u)
      << "1.3 times the mean, but any move makes the other as busy";
  EXPECT_TRUE(plan_rebalance({member_with("a", {5000}), member_with("b", {})}).moves.empty())
      << "one scene is the whole load";
  EXPECT_TRUE(plan_rebalance({member_with("a", {}), member_with("b", {})}).moves.empty());
  EXPECT_TRUE(plan_rebalance({}).moves.empty());
}

TEST(RebalanceTest, ScenesThatMustStayCountButDoNotMove) {
  MemberLoad fixed{"a"};
  fixed.fixed = 9000;
  const RebalancePlan plan = plan_rebalance({fixed, member_with("b", {1000})});
  EXPECT_EQ(plan.busiest_before, 9000u);
  EXPECT_TRUE(plan.moves.empty());
}

TEST(RebalanceTest, RandomClustersEndBalancedOrWhereNoMoveHelps) {
  for (uint64_t seed = 0; seed < 300; ++seed) {
    std::mt19937_64 random(seed);
    std::vector<MemberLoad> members;
    for (uint64_t i = 0; i < 1 + random() % 8; ++i) {
      std::vector<uint64_t> loads(random() % 30);
      for (uint64_t& load : loads) load = kSceneLoad + (random() % 4 == 0 ? random() % 200'000 : random() % 500);
      members.push_back(member_with(absl::StrCat("m", i), loads));
    }
    const RebalancePlan plan = plan_rebalance(members);
    const std::map<std::string, uint64_t> after = loads_after(members, plan.moves);
    uint64_t largest = 0, smallest = UINT64_MAX;
    for (const auto& [address, load] : after) {
      largest = std::max(largest, load);
      smallest = std::min(smallest, load);
    }
    EXPECT_EQ(plan.busiest_after, largest) << seed;
    EXPECT_LE(plan.busiest_after, plan.busiest_before) << seed;
    if (static_cast<double>(largest) <= kBalancedShare * plan.mean) continue;
    // Some member of the largest load has only scenes that would make the least loaded one as busy.
    std::map<std::string, std::vector<uint64_t>> scenes;
    std::map<std::string, std::string> leaders;
    for (const MemberLoad& member : members)
      for (const SceneLoad& scene : member.scenes) leaders[scene.name] = member.address;
    for (const PlannedMove& move : plan.moves) leaders[move.scene] = move.to;
    for (const MemberLoad& member : members)
      for (const SceneLoad& scene : member.scenes) scenes[leaders[scene.name]].push_back(scene.load);
    bool stuck = false;
    for (const auto& [address, load] : after)
      stuck |= load == largest && std::all_of(scenes[address].begin(), scenes[address].end(),
                                              [&](uint64_t scene) { return smallest + scene >= largest; });
    EXPECT_TRUE(stuck) << "seed " << seed;
  }
}

TEST(RebalanceTest, ADrainedMemberGivesEachSceneToTheLeastLoaded) {
  const MemberLoad source = member_with("a", {1000, 1000, 5000, 1000});
  const std::vector<PlannedMove> moves = plan_drain(source, {member_with("b", {3000}), member_with("c", {1500})});
  std::vector<std::string> targets;
  for (const PlannedMove& move : moves) targets.push_back(move.to);
  EXPECT_THAT(targets, testing::ElementsAre("c", "c", "b", "c"));
}

}  // namespace
}  // namespace locus::cli
