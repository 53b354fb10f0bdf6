#include "client/cli/context.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/run.h"
#include "tests/client/lib/fake_server.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

class ContextTest : public ::testing::Test {
 protected:
  ExitCode run_here(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--address", server_.address()});
    return run_line(arguments, context_);
  }
  void query(const std::vector<std::string>& more = {}) {
    std::vector<std::string> line = {"query", "ball", "arena", "--at", "0,0,0", "--radius", "1"};
    line.insert(line.end(), more.begin(), more.end());
    run_here(line);
  }

  client::testing::FakeServer server_;
  std::ostringstream out_;
  std::ostringstream err_;
  Context context_{out_, err_, Progress::kSilent};
};

TEST_F(ContextTest, AQueryAsksForAtLeastTheLastAcknowledgedRevision) {
  query();
  EXPECT_FALSE(server_.queries.last_batch.has_view());
  ASSERT_EQ(run_here({"remove", "arena", "--id", "7"}), ExitCode::kOk);
  query();
  EXPECT_EQ(server_.queries.last_batch.view().at_least(), 1u);
  EXPECT_EQ(server_.queries.last_batch.view().epoch(), 9u);
  run_here({"get", "arena", "--id", "7"});
  EXPECT_EQ(server_.queries.last_batch.view().at_least(), 1u);
}

TEST_F(ContextTest, AViewGivenOnTheLineOverridesTheAcknowledgedRevision) {
  ASSERT_EQ(run_here({"remove", "arena", "--id", "7"}), ExitCode::kOk);
  query({"--exactly", "5"});
  EXPECT_EQ(server_.queries.last_batch.view().exactly(), 5u);
}

TEST_F(ContextTest, AnAckOfAnotherSceneDoesNotChangeTheView) {
  ASSERT_EQ(run_here({"remove", "hall", "--id", "7"}), ExitCode::kOk);
  query();
  EXPECT_FALSE(server_.queries.last_batch.has_view());
}

TEST_F(ContextTest, DeletingASceneForgetsItsAcknowledgedRevision) {
  ASSERT_EQ(run_here({"scene", "create", "arena"}), ExitCode::kOk);
  query();
  EXPECT_EQ(server_.queries.last_batch.view().epoch(), uint64_t{1} << 63);
  ASSERT_EQ(run_here({"scene", "delete", "arena"}), ExitCode::kOk);
  query();
  EXPECT_FALSE(server_.queries.last_batch.has_view());
}

TEST_F(ContextTest, ARedirectedAnswerDoesNotReachTheOutput) {
  run_here({"scene", "create", "arena"});
  std::ostringstream answer;
  std::ostream& before = context_.redirect_out(answer);
  run_here({"scene", "list"});
  context_.redirect_out(before);
  EXPECT_THAT(answer.str(), ::testing::HasSubstr("arena"));
  EXPECT_EQ(&context_.out(), &before);
}

TEST_F(ContextTest, AFailedLineDoesNotChangeTheExitCodeOfTheNext) {
  EXPECT_EQ(run_here({"scene", "describe", "nowhere"}), ExitCode::kNotFound);
  EXPECT_EQ(run_here({"--help"}), ExitCode::kOk);
  EXPECT_EQ(run_here({"limits"}), ExitCode::kOk);
}

}  // namespace
}  // namespace locus::cli
