// `locus scene create --cell-size`, `scene update` and `scene get` against a real server.
#include "client/cli/run.h"
#include "tests/support/cli_outcome.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using cli::Json;
using ::testing::HasSubstr;

class SceneSettingsCliTest : public RpcTest {
 protected:
  Outcome run(const std::vector<std::string>& line) { return run_cli(running_.address(), line); }
  Json json(std::vector<std::string> line) {
    line.insert(line.begin(), {"-o", "json"});
    const Outcome outcome = run(line);
    EXPECT_EQ(outcome.code, cli::ExitCode::kOk) << outcome.err;
    return Json::parse(outcome.out, nullptr, /*allow_exceptions=*/false);
  }
};

TEST_F(SceneSettingsCliTest, SettingsAreGivenChangedAndShown) {
  EXPECT_EQ(json({"scene", "create", "arena", "--cell-size", "3", "--label", "map=delta"})["cell_size"], 4);
  const Json updated = json({"scene", "update", "arena", "--cell-size", "0.5", "--label", "mode=ctf"});
  EXPECT_EQ(updated["cell_size"], 0.5);
  EXPECT_EQ(updated["labels"], Json::parse(R"({"mode": "ctf"})"));
  EXPECT_EQ(json({"scene", "get", "arena"})["cell_size"], 0.5);
  EXPECT_EQ(json({"scene", "update", "arena", "--no-labels"})["labels"], Json::object());
  EXPECT_EQ(json({"scene", "update", "arena", "--cell-size", "0"})["cell_size"], 0);
  EXPECT_EQ(run({"scene", "update", "arena", "--cell-size", "8"}).out, "updated arena\n");
}

TEST_F(SceneSettingsCliTest, MistakesAreNamed) {
  EXPECT_EQ(run({"scene", "update", "world"}).code, cli::ExitCode::kUsage);
  EXPECT_EQ(run({"scene", "update", "world", "--label", "a=b", "--no-labels"}).code, cli::ExitCode::kUsage);
  const Outcome outcome = run({"scene", "update", "world", "--cell-size", "1e300"});
  EXPECT_EQ(outcome.code, cli::ExitCode::kFailed);
  EXPECT_THAT(outcome.err, HasSubstr("cell_size"));
  EXPECT_EQ(run({"scene", "update", "nowhere", "--cell-size", "1"}).code, cli::ExitCode::kNotFound);
}

TEST_F(SceneSettingsCliTest, GetShowsStructuresAndCosts) {
  ASSERT_TRUE(apply(insert_balls(1, 500)).ok());
  ASSERT_TRUE(query(ray_along_x()).ok());
  const Json shown = json({"scene", "get", "world"});
  EXPECT_EQ(shown["static_structure"]["kind"], "bvh");
  EXPECT_EQ(shown["object_structure"]["kind"], "hash_grid");
  EXPECT_EQ(shown["object_structure"]["values"], 500);
  EXPECT_GT(shown["object_structure"]["bricks"], 0);
  ASSERT_EQ(shown["costs"].size(), 1u) << shown;
  EXPECT_EQ(shown["costs"][0]["kind"], "rays_first");
  EXPECT_GT(shown["costs"][0]["work"], 0);
  EXPECT_EQ(json({"scene", "describe", "world"})["object_structure"], shown["object_structure"]);
}

}  // namespace
}  // namespace locus::test
