#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <thread>

#include "client/cli/run.h"
#include "tests/client/lib/fake_server.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

class WaitCommandTest : public ::testing::Test {
 protected:
  WaitCommandTest() { scene().set_name("arena"); }
  v1::Scene& scene() { return server_.scenes.scenes["arena"]; }
  ExitCode wait(const std::vector<std::string>& more) {
    std::vector<std::string> line = {"-a", server_.address(), "-o", "json", "wait", "arena"};
    line.insert(line.end(), more.begin(), more.end());
    return run_line(line, context_);
  }

  client::testing::FakeServer server_;
  std::ostringstream out_;
  std::ostringstream err_;
  Context context_{out_, err_, Progress::kSilent};
};

TEST_F(WaitCommandTest, ASceneWithoutPendingChangesIsReadyAtOnce) {
  scene().set_revision(4);
  EXPECT_EQ(wait({}), ExitCode::kOk) << err_.str();
  EXPECT_EQ(Json::parse(out_.str())["revision"], 4);
}

TEST_F(WaitCommandTest, PendingChangesAreAwaitedAndABuildErrorIsReported) {
  scene().set_pending_changes(1);
  std::thread builder([this] {
    v1::Scene ready;
    ready.set_name("arena");
    ready.set_revision(5);
    ready.set_last_build_error("too deep");
    server_.scenes.replace(ready);
  });
  EXPECT_EQ(wait({"--for", "60"}), ExitCode::kOk) << err_.str();
  builder.join();
  EXPECT_EQ(Json::parse(out_.str())["last_build_error"], "too deep");
}

TEST_F(WaitCommandTest, ATimeoutReportsTheRevisionAndThePendingChanges) {
  scene().set_pending_changes(2);
  EXPECT_EQ(wait({"--for", "0"}), ExitCode::kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("after 0 s scene arena is at revision 0 with 2 changes of instances to come"));
}

TEST_F(WaitCommandTest, ARevisionIsAwaited) {
  scene().set_revision(4);
  EXPECT_EQ(wait({"--revision", "4"}), ExitCode::kOk);
  EXPECT_EQ(wait({"--revision", "5", "--for", "0"}), ExitCode::kFailed);
}

TEST_F(WaitCommandTest, AMissingSceneIsNotFound) {
  server_.scenes.scenes.clear();
  EXPECT_EQ(wait({}), ExitCode::kNotFound);
}

TEST_F(WaitCommandTest, TooLongAWaitIsAUsageError) { EXPECT_EQ(wait({"--for", "1e9"}), ExitCode::kUsage); }

}  // namespace
}  // namespace locus::cli
