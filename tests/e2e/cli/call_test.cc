// `locus call` against a real server.
#include <sstream>

#include "client/cli/run.h"
#include "locus/rpc_paths.h"
#include "tests/support/cli_outcome.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using cli::Json;
using ::testing::HasSubstr;

class CallTest : public RpcTest {
 protected:
  Outcome run(const std::vector<std::string>& arguments) { return run_cli(running_.address(), arguments); }

  Json reply_of(const std::string& method, const std::string& request) {
    const Outcome outcome = run({"call", method, request});
    EXPECT_EQ(outcome.code, cli::ExitCode::kOk) << outcome.err;
    return Json::parse(outcome.out, nullptr, /*allow_exceptions=*/false);
  }
};

TEST_F(CallTest, FullAndShortNamesCallTheSameMethod) {
  for (const std::string name :
       {"GetScene", "SceneService/GetScene", "locus.v1.SceneService/GetScene", "/locus.v1.SceneService/GetScene"})
    EXPECT_EQ(reply_of(name, R"({"name": "world"})")["scene"]["name"], "world") << name;
}

TEST_F(CallTest, IdsOf64BitsSurvive) {
  constexpr char kLargest[] = "18446744073709551615";
  for (const std::string id : {"\"18446744073709551615\"", "18446744073709551615"}) {
    const std::string batch = R"({"scene": "world", "batch": {"upsert": true, "inserts": [{"ids": [)" + id +
                              R"(], "positions": [1, 2, 3], "tags": [)" + id + R"(], "ball": {"radii": [1]}}]}})";
    EXPECT_EQ(reply_of("ApplyUpdates", batch)["ack"]["applied"], 1);
    const std::string query = R"({"scene": "world", "batch": {"blocks": [{"lookup": {"ids": [)" + id +
                              R"(]}, "columns": ["COLUMN_ID", "COLUMN_TAG"]}]}})";
    const Json block = reply_of("Query", query)["result"]["blocks"][0];
    EXPECT_EQ(block["ids"], Json::array({kLargest}));
    EXPECT_EQ(block["tags"], Json::array({kLargest}));
  }
}

TEST_F(CallTest, AStepIsAppliedAndItsQueriesSeeIt) {
  const Json reply =
      reply_of("Step", R"({"scene": "world", "update": {"inserts": [{"ids": ["7"], "positions": [1, 2, 3],
      "ball": {"radii": [1]}}]}, "queries": {"blocks": [{"lookup": {"ids": ["7", "8"]}}]}})");
  EXPECT_EQ(reply["ack"]["applied"], 1);
  EXPECT_EQ(reply["result"]["revision"], reply["ack"]["revision"]);
  EXPECT_EQ(reply["result"]["blocks"][0]["ids"], Json::array({"7", "0"}));
  const Outcome refused = run({"call", "Step", R"({"scene": "world", "queries": {"view": {"exactly": "1"}}})"});
  EXPECT_EQ(refused.code, cli::ExitCode::kFailed) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("view.exactly"));
}

TEST_F(CallTest, WithoutJsonTheRequestIsEmpty) {
  const Outcome outcome = run({"call", "GetServer"});
  ASSERT_EQ(outcome.code, cli::ExitCode::kOk) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("\"version\""));
}

TEST_F(CallTest, MistakesNameWhatIsMeant) {
  const auto usage_error = [this](const std::vector<std::string>& line) {
    const Outcome outcome = run(line);
    EXPECT_EQ(outcome.code, cli::ExitCode::kUsage);
    EXPECT_EQ(outcome.out, "");
    return outcome.err;
  };
  EXPECT_THAT(usage_error({"call", "GetScenes"}), HasSubstr("there is no method `GetScenes`; did you mean `GetScene"));
  EXPECT_THAT(usage_error({"call", "locus.v1.SceneService/CreateScenes"}),
              HasSubstr("did you mean `locus.v1.SceneService/CreateScene`?"));
  EXPECT_THAT(usage_error({"call", "StreamUpdates"}), HasSubstr("`StreamUpdates` is a stream"));
  EXPECT_THAT(usage_error({"call", "GetScene", "{\"nam\": 1}"}),
              HasSubstr("the request is no GetSceneRequest in JSON"));
  EXPECT_THAT(usage_error({"call"}), HasSubstr("give a METHOD, or --list"));
  EXPECT_THAT(usage_error({"call", "--list", "GetScene"}), HasSubstr("leave METHOD out"));
}

TEST_F(CallTest, RefusalsOfTheServerHaveTheirExitCodes) {
  const Outcome outcome = run({"call", "GetScene", R"({"name": "nowhere"})"});
  EXPECT_EQ(outcome.code, cli::ExitCode::kNotFound);
  EXPECT_THAT(outcome.err, HasSubstr("nowhere"));
}

TEST_F(CallTest, TheListHasEveryMethodOfTheServer) {
  const Outcome outcome = run({"-o", "csv", "call", "--list"});
  ASSERT_EQ(outcome.code, cli::ExitCode::kOk) << outcome.err;
  for (const std::string_view path : kRpcPaths) {
    if (path.find("/locus.v1.") != 0) continue;
    EXPECT_THAT(outcome.out, HasSubstr("\n" + std::string(path.substr(1)) + ","));
  }
  EXPECT_THAT(outcome.out, HasSubstr("locus.v1.QueryService/Query,QueryRequest,QueryResponse,true\n"));
  EXPECT_THAT(outcome.out,
              HasSubstr("locus.v1.UpdateService/StreamUpdates,StreamUpdatesRequest,StreamUpdatesResponse,false"));
}

}  // namespace
}  // namespace locus::test
