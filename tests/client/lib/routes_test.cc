#include "client/lib/routes.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "absl/strings/str_cat.h"

namespace locus::client {
namespace {

const char* const kA = "10.0.0.1:7575";
const char* const kB = "10.0.0.2:7575";
const char* const kC = "10.0.0.3:7575";

class RoutesTest : public ::testing::Test {
 protected:
  void elsewhere(const std::string& teller, const std::string& leader, uint64_t token,
                 const std::string& scene = "arena") {
    v1::Error error;
    error.add_addresses(leader);
    error.set_token(token);
    routes_.elsewhere(scene, teller, error);
  }
  static v1::ScenePlacement placed(const std::string& leader, const std::vector<std::string>& followers) {
    v1::ScenePlacement placement;
    placement.set_leader(leader);
    for (const std::string& follower : followers) placement.add_followers()->set_address(follower);
    return placement;
  }

  absl::Time now_ = absl::FromUnixSeconds(1000);
  Routes routes_{{kA, kB, kC}, [this] { return now_; }};
};

TEST_F(RoutesTest, WithoutKnowledgeTheFirstServerThatDidNotFailIsAsked) {
  EXPECT_EQ(routes_.next("arena"), kA);
  routes_.failed(kA);
  EXPECT_EQ(routes_.next("arena"), kB);
  now_ += absl::Milliseconds(1);
  routes_.failed(kB);
  routes_.failed(kC);
  EXPECT_EQ(routes_.next("arena"), kA);  // the one that failed first
}

TEST_F(RoutesTest, ANamedLeaderIsAskedThoughItWasNotGiven) {
  elsewhere(kA, "10.0.0.4", 5);
  EXPECT_EQ(routes_.next("arena"), "10.0.0.4:7575");
  EXPECT_EQ(routes_.next("hall"), kA);
  EXPECT_EQ(routes_.all().size(), 4u);
}

TEST_F(RoutesTest, TheNewerTokenWins) {
  elsewhere(kA, kB, 5);
  elsewhere(kA, kC, 4);
  EXPECT_EQ(routes_.next("arena"), kB);
  elsewhere(kA, kC, 6);
  EXPECT_EQ(routes_.next("arena"), kC);
}

TEST_F(RoutesTest, AnOlderTokenCountsOnceTheLeaderFailedOrSaysSo) {
  elsewhere(kA, kB, 5);
  elsewhere(kB, kC, 1);
  EXPECT_EQ(routes_.next("arena"), kC);
  elsewhere(kA, kB, 5);
  routes_.failed(kB);
  elsewhere(kA, kC, 1);
  EXPECT_EQ(routes_.next("arena"), kC);
}

TEST_F(RoutesTest, ALeaderThatFailedOrDoesNotLeadYetIsAskedAgainLater) {
  elsewhere(kA, kB, 5);
  routes_.has_no_leader("arena", kB, absl::Milliseconds(250));
  EXPECT_NE(routes_.next("arena"), kB);
  now_ += absl::Milliseconds(300);
  EXPECT_EQ(routes_.next("arena"), kB);
  routes_.failed(kB);
  EXPECT_NE(routes_.next("arena"), kB);
  EXPECT_FALSE(routes_.would_answer(kB));
  now_ += absl::Seconds(2);
  EXPECT_EQ(routes_.next("arena"), kB);
  routes_.failed(kB);
  routes_.answered(kB);
  EXPECT_EQ(routes_.next("arena"), kB);
}

TEST_F(RoutesTest, ReadersAreKeptWhileTheyAnswer) {
  EXPECT_EQ(routes_.reader("arena"), std::nullopt);
  const v1::ScenePlacement placement = placed(kA, {kB, kC});
  routes_.set_readers("arena", &placement, ReadFrom::kFollower);
  const std::string chosen = *routes_.reader("arena");
  routes_.failed(chosen);
  const std::string other = *routes_.reader("arena");
  EXPECT_EQ((std::set<std::string>{chosen, other}), (std::set<std::string>{kB, kC}));
  routes_.set_readers("arena", nullptr, ReadFrom::kFollower);  // the leader did not answer
  EXPECT_EQ(routes_.reader("arena"), other);
  now_ += absl::Minutes(1);
  EXPECT_EQ(routes_.reader("arena"), std::nullopt);
}

TEST_F(RoutesTest, ReadersAreThoseThatTheUserAdmits) {
  const v1::ScenePlacement alone = placed(kA, {});
  routes_.set_readers("arena", &alone, ReadFrom::kFollower);
  EXPECT_EQ(routes_.reader("arena"), kA);
  const v1::ScenePlacement followed = placed(kA, {kB});
  std::set<std::string> seen;
  for (int i = 0; i < 200; ++i) {
    routes_.forget_readers("arena");
    routes_.set_readers("arena", &followed, ReadFrom::kAny);
    seen.insert(*routes_.reader("arena"));
  }
  EXPECT_EQ(seen, (std::set<std::string>{kA, kB}));
}

TEST_F(RoutesTest, OnlyTheLeaderChangesTheEpochOfTheHighestRevision) {
  EXPECT_EQ(routes_.floor("arena"), std::nullopt);
  routes_.saw("arena", {1, 5}, false);
  routes_.saw("arena", {1, 3}, true);
  routes_.saw("arena", {2, 1}, false);
  EXPECT_EQ(routes_.floor("arena"), (Revision{1, 5}));
  routes_.saw("arena", {2, 1}, true);
  EXPECT_EQ(routes_.floor("arena"), (Revision{2, 1}));
  routes_.forget("arena");
  EXPECT_EQ(routes_.floor("arena"), std::nullopt);
}

TEST_F(RoutesTest, MemoryIsBounded) {
  for (size_t i = 0; i < Routes::kMaxScenes + 100; ++i) {
    const std::string scene = absl::StrCat("s", i);
    elsewhere(kA, absl::StrCat("10.0.", i / 250, ".", i % 250, ":1"), 1, scene);
    routes_.saw(scene, {1, 1}, true);
  }
  EXPECT_EQ(routes_.all().size(), 3 + Routes::kMaxLearned);
  EXPECT_NE(routes_.floor(absl::StrCat("s", Routes::kMaxScenes + 99)), std::nullopt);
}

}  // namespace
}  // namespace locus::client
