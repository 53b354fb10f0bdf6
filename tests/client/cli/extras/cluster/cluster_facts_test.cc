#include "client/cli/extras/cluster/cluster_facts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace locus::cli {
namespace {

v1::Cluster two_members() {
  v1::Cluster cluster;
  for (const uint64_t id : {7, 9}) {
    v1::ClusterMember& member = *cluster.add_members();
    member.set_id(id);
    member.set_address("10.0.0." + std::to_string(id) + ":7575");
    member.set_version("1.2.3");
  }
  cluster.mutable_members(0)->set_zone("a");
  cluster.mutable_members(0)->set_load(2100);
  cluster.mutable_members(1)->set_draining(true);
  cluster.set_member(9);
  cluster.set_engine("db1,db2");
  cluster.set_engine_answers(true);
  return cluster;
}

const std::vector<LedScene> kThreeScenes = {{"arena", "10.0.0.7:7575"}, {"lobby", ""}, {"yard", "10.0.0.7:7575"}};

TEST(ClusterFactsTest, TheReportHasTheMembersTheEngineAndWhoLeadsHowManyScenes) {
  const Report report = report_of(two_members(), &kThreeScenes);
  ASSERT_EQ(report.rows.size(), 2u);
  EXPECT_EQ(report.rows[0].dump(), R"({"address":"10.0.0.7:7575","zone":"a","version":"1.2.3","load":2100,)"
                                   R"("draining":false,"scenes":2,"this":false})");
  EXPECT_EQ(report.rows[1].dump(), R"({"address":"10.0.0.9:7575","zone":null,"version":"1.2.3","load":null,)"
                                   R"("draining":true,"scenes":0,"this":true})");
  EXPECT_EQ(report.head.dump(), R"({"engine":"db1,db2","engine_answers":true,"scenes":3,"no_leader":1})");
}

TEST(ClusterFactsTest, WithoutTheEngineTheNumbersOfScenesAreNotKnown) {
  v1::Cluster cluster = two_members();
  cluster.set_engine_answers(false);
  cluster.set_engine("");
  const Report report = report_of(cluster, nullptr);
  EXPECT_EQ(report.rows[0]["scenes"], nullptr);
  EXPECT_EQ(report.head.dump(), R"({"engine":null,"engine_answers":false,"scenes":null,"no_leader":null})")
      << "some callers may not see the engine's hosts";
}

TEST(ClusterFactsTest, TheMapHasALineForEachSceneThatHasALeader) {
  EXPECT_EQ(map_lines(kThreeScenes), "arena 10.0.0.7:7575\nyard 10.0.0.7:7575\n");
  EXPECT_EQ(map_lines({}), "");
}

TEST(ClusterFactsTest, AnUnknownMemberIsRefusedWithTheKnownOnes) {
  EXPECT_EQ(find_member(two_members(), "10.0.0.9:7575")->id(), 9u);
  const absl::Status refused = find_member(two_members(), "10.0.0.8:7575").status();
  EXPECT_TRUE(absl::IsNotFound(refused));
  EXPECT_THAT(std::string(refused.message()), testing::HasSubstr("its members are 10.0.0.7:7575, 10.0.0.9:7575"));
}

TEST(ClusterFactsTest, RolesAreWordsInLowerCase) {
  EXPECT_EQ(role_name(v1::SCENE_ROLE_LEADING), "leading");
  EXPECT_EQ(role_name(v1::SCENE_ROLE_NO_LEADER), "no_leader");
}

}  // namespace
}  // namespace locus::cli
