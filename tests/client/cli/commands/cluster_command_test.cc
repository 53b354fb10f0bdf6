// `locus cluster` against a server that says what the test wants. tests/e2e/cli/cluster_command_test.cc has a cluster.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "client/cli/run.h"
#include "tests/client/lib/fake_server.h"
#include "tests/support/cli_outcome.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

class ClusterCommandTest : public ::testing::Test {
 protected:
  test::Outcome run_here(const std::vector<std::string>& line) { return test::run_cli(server_.address(), line); }
  // Lets the server be one of two members.
  void join() {
    server_.servers.cluster.emplace();
    v1::Cluster& cluster = *server_.servers.cluster;
    for (const char* const address : {"10.0.0.7:7575", "10.0.0.8:7575"}) {
      v1::ClusterMember& member = *cluster.add_members();
      member.set_id(static_cast<uint64_t>(cluster.members_size()));
      member.set_address(address);
    }
    cluster.set_member(1);
    cluster.set_engine("db1,db2");
    cluster.set_engine_answers(true);
  }

  client::testing::FakeServer server_;
};

const std::vector<std::vector<std::string>> kLines = {{"cluster", "status"},
                                                      {"cluster", "move", "arena"},
                                                      {"cluster", "drain", "10.0.0.7:7575"},
                                                      {"cluster", "rebalance"},
                                                      {"cluster", "map"}};

TEST_F(ClusterCommandTest, AServerWithoutAClusterIsNamed) {
  for (const std::vector<std::string>& line : kLines) {
    const test::Outcome outcome = run_here(line);
    EXPECT_EQ(outcome.code, ExitCode::kFailed) << line[1];
    EXPECT_THAT(outcome.err, HasSubstr("the server at " + server_.address() + " belongs to no cluster")) << line[1];
    EXPECT_EQ(outcome.out, "") << line[1];
  }
}

TEST_F(ClusterCommandTest, WithoutTheEngineTheStatusIsShownAndNothingIsMoved) {
  join();
  server_.servers.cluster->set_engine_answers(false);
  const test::Outcome shown = run_here({"cluster", "status"});
  EXPECT_EQ(shown.code, ExitCode::kFailed);
  EXPECT_THAT(shown.out, HasSubstr("10.0.0.8:7575"));
  EXPECT_THAT(shown.err, HasSubstr("the engine db1,db2 does not answer"));
  for (const std::vector<std::string>& line : {kLines[2], kLines[3]})
    EXPECT_THAT(run_here(line).err, HasSubstr("the engine db1,db2 does not answer")) << line[1];
}

TEST_F(ClusterCommandTest, WhileAMemberDrainsNothingIsRebalancedAndItIsNotDrainedTwice) {
  join();
  server_.servers.cluster->mutable_members(1)->set_draining(true);
  const test::Outcome outcome = run_here({"cluster", "rebalance", "--dry-run"});
  EXPECT_EQ(outcome.code, ExitCode::kFailed);
  EXPECT_THAT(outcome.err, HasSubstr("10.0.0.8:7575 drains"));
  EXPECT_THAT(run_here({"cluster", "drain", "10.0.0.8:7575"}).err, HasSubstr("10.0.0.8:7575 drains already"));
}

TEST_F(ClusterCommandTest, AMemberThatDoesNotExistOrAnswerIsNotDrained) {
  join();
  const test::Outcome unknown = run_here({"cluster", "drain", "10.0.0.9:7575"});
  EXPECT_EQ(unknown.code, ExitCode::kNotFound);
  EXPECT_THAT(unknown.err, HasSubstr("its members are 10.0.0.7:7575, 10.0.0.8:7575"));
  server_.servers.cluster->mutable_members(1)->set_address("127.0.0.1:1");
  const test::Outcome silent = run_here({"--timeout", "1", "cluster", "drain", "127.0.0.1:1"});
  EXPECT_EQ(silent.code, ExitCode::kUnreachable);
}

}  // namespace
}  // namespace locus::cli
