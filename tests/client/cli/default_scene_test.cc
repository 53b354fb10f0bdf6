#include "client/cli/default_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/run.h"
#include "tests/client/lib/fake_server.h"

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Optional;

std::optional<std::vector<std::string>> completed(const std::vector<std::string>& arguments) {
  std::ostringstream out;
  Context context(out, out, Progress::kSilent);
  CLI::App app;
  build_cli(app, context);
  return with_scene(app, arguments, "arena");
}

TEST(DefaultSceneTest, TheSceneIsInsertedDirectlyAfterTheCommand) {
  EXPECT_THAT(completed({"get", "--id", "7"}), Optional(ElementsAre("get", "arena", "--id", "7")));
  EXPECT_THAT(completed({"query", "ray", "--from", "0,0,0"}),
              Optional(ElementsAre("query", "ray", "arena", "--from", "0,0,0")));
  EXPECT_THAT(completed({"insert", "ball", "--id", "7"}),
              Optional(ElementsAre("insert", "arena", "ball", "--id", "7")));
}

TEST(DefaultSceneTest, AnOptionsValueIsNotMistakenForACommand) {
  EXPECT_THAT(completed({"-a", "get", "--output=json", "-o", "query", "get"}),
              Optional(ElementsAre("-a", "get", "--output=json", "-o", "query", "get", "arena")));
}

TEST(DefaultSceneTest, CommandsWithoutSceneGetNone) {
  EXPECT_EQ(completed({"limits"}), std::nullopt);
  EXPECT_EQ(completed({"scene", "create"}), std::nullopt);
  EXPECT_EQ(completed({"scene", "delete"}), std::nullopt) << "deleting takes a name, always";
  EXPECT_EQ(completed({"query"}), std::nullopt);
  EXPECT_EQ(completed({}), std::nullopt);
}

class DefaultSceneRunTest : public ::testing::Test {
 protected:
  ExitCode run_here(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--address", server_.address()});
    return run_line(arguments, context_);
  }

  client::testing::FakeServer server_;
  std::ostringstream out_;
  std::ostringstream err_;
  Context context_{out_, err_, Progress::kSilent};
};

TEST_F(DefaultSceneRunTest, ALineWithoutSceneUsesTheDefault) {
  context_.use_scene("arena");
  EXPECT_EQ(run_here({"query", "ball", "--at", "0,0,0", "--radius", "1"}), ExitCode::kFailed)
      << "the fake server answers no blocks";
  EXPECT_EQ(server_.queries.scene, "arena");
  EXPECT_EQ(run_here({"insert", "ball", "--id", "7", "--at", "0,0,0", "--radius", "1"}), ExitCode::kOk) << err_.str();
  EXPECT_THAT(server_.updates.scenes, ElementsAre("arena"));
}

TEST_F(DefaultSceneRunTest, ALineWithASceneKeepsIt) {
  context_.use_scene("arena");
  EXPECT_EQ(run_here({"insert", "hall", "ball", "--id", "7", "--at", "0,0,0", "--radius", "1"}), ExitCode::kOk);
  EXPECT_THAT(server_.updates.scenes, ElementsAre("hall"));
}

TEST_F(DefaultSceneRunTest, AnotherMissingOptionIsStillReported) {
  context_.use_scene("arena");
  EXPECT_EQ(run_here({"insert", "ball", "--id", "7"}), ExitCode::kUsage);
  EXPECT_THAT(err_.str(), HasSubstr("give --id and --at, or rows"));
}

TEST_F(DefaultSceneRunTest, ImportAndGenerateUseTheDefaultScene) {
  context_.use_scene("arena");
  EXPECT_EQ(run_here({"generate", "city", "--triangles", "100", "--create"}), ExitCode::kOk) << err_.str();
  EXPECT_EQ(server_.scenes.last_change.scene(), "arena");
  EXPECT_EQ(run_here({"import", "/nonexistent/level.obj"}), ExitCode::kNotFound)
      << "the file, not an option, is missing";
}

TEST_F(DefaultSceneRunTest, WithoutADefaultTheSceneIsRequired) {
  EXPECT_EQ(run_here({"get", "--id", "7"}), ExitCode::kUsage);
  EXPECT_THAT(err_.str(), HasSubstr("SCENE is required"));
}

}  // namespace
}  // namespace locus::cli
