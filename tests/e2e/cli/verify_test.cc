// `locus verify` against a real server.
#include <fstream>

#include "client/cli/run.h"
#include "tests/support/cli_outcome.h"
#include "tests/support/rpc_test.h"
#include "tests/support/temporary_folder.h"

namespace locus::test {
namespace {

using cli::Json;
using ::testing::HasSubstr;

// Scene with balls at x = 3, 6, ..., 1500 and a cube, and a past of two ticks.
class VerifyTest : public RpcTest {
 protected:
  void SetUp() override {
    v1::SceneSpec spec;
    spec.set_history_ticks(8);
    ASSERT_TRUE(create("arena", spec).ok());
    run_ok({"generate", "city", "--triangles", "2000", "--seed", "1", "--scene", "arena"});
    run_ok({"insert", "arena", "ball", "--from-csv", rows("balls", "id,at.x,at.y,at.z,radius", 500, [](int i) {
              return absl::StrCat(i, ",", 3 * i - 700, ",", i % 7, ",", i % 40 - 20, ",1.5");
            })});
    run_ok({"move", "arena", "--id", "7", "--to", "1,2,3", "--tick", "3"});
    run_ok({"move", "arena", "--id", "7", "--to", "5,2,3", "--tick", "4"});
  }

  Outcome run(const std::vector<std::string>& line) { return run_cli(running_.address(), line); }
  void run_ok(const std::vector<std::string>& line) {
    const Outcome outcome = run(line);
    EXPECT_EQ(outcome.code, cli::ExitCode::kOk) << outcome.err;
  }
  Json verified(std::vector<std::string> line) {
    line.insert(line.begin(), {"-o", "json", "verify", "arena"});
    const Outcome outcome = run(line);
    EXPECT_EQ(outcome.code, cli::ExitCode::kOk) << outcome.err;
    return Json::parse(outcome.out, nullptr, /*allow_exceptions=*/false);
  }
  template <class Row>
  std::string rows(const std::string& name, const std::string& header, int count, const Row& row) {
    std::ofstream file(folder_.file(name + ".csv"));
    file << header << "\n";
    for (int i = 1; i <= count; ++i) file << row(i) << "\n";
    return folder_.file(name + ".csv");
  }

  TemporaryFolder folder_;
};

TEST_F(VerifyTest, ARightServerHasNoDifferenceInQueriesOfAnyKind) {
  const Json report = verified({"--seconds", "2", "--seed", "5"});
  EXPECT_EQ(report["differences"], 0);
  EXPECT_EQ(report["kinds"].size(), 12u) << report;
  EXPECT_GT(report["queries"], 50);
  EXPECT_EQ(report["seed"], 5);
}

TEST_F(VerifyTest, RowsOfAFileAreVerifiedOnceAndTheirKindIsKnown) {
  const auto ray = [](int i) { return absl::StrCat(i, ",90,", i % 9, ",0.1,-1,0"); };
  Json report = verified({"--queries", rows("rays", "from.x,from.y,from.z,dir.x,dir.y,dir.z", 150, ray)});
  EXPECT_EQ(report["kinds"], Json::parse(R"([{"kind": "rays", "queries": 150}])"));
  EXPECT_EQ(report["differences"], 0);
  const auto ball = [](int i) { return absl::StrCat(i, ",1,2,", i % 9); };
  report = verified({"--queries", rows("balls-asked", "at.x,at.y,at.z,radius", 20, ball)});
  EXPECT_EQ(report["kinds"], Json::parse(R"([{"kind": "balls", "queries": 20}])"));
  std::ofstream(folder_.file("points.ndjson")) << R"({"at": [1, 2, 3]})"
                                               << "\n";
  report = verified({"--queries", folder_.file("points.ndjson")});
  EXPECT_EQ(report["kinds"][0]["kind"], "nearest");
  report = verified({"--queries", folder_.file("points.ndjson"), "--kind", "contains"});
  EXPECT_EQ(report["kinds"][0]["kind"], "contains");
}

TEST_F(VerifyTest, MistakesAreNamed) {
  Outcome outcome = run({"verify", "nowhere", "--seconds", "1"});
  EXPECT_EQ(outcome.code, cli::ExitCode::kNotFound) << outcome.err;
  outcome = run({"verify", "arena", "--kind", "ray"});
  EXPECT_EQ(outcome.code, cli::ExitCode::kUsage) << outcome.err;
  std::ofstream(folder_.file("bad.ndjson")) << R"({"from": [1, 2, 3], "dir": "up"})"
                                            << "\n";
  outcome = run({"verify", "arena", "--queries", folder_.file("bad.ndjson")});
  EXPECT_EQ(outcome.code, cli::ExitCode::kFailed) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("bad.ndjson:1"));
  std::ofstream(folder_.file("other.ndjson")) << R"({"colour": 5})"
                                              << "\n";
  outcome = run({"verify", "arena", "--queries", folder_.file("other.ndjson")});
  EXPECT_EQ(outcome.code, cli::ExitCode::kUsage) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("--kind"));
  outcome = run({"verify", "arena", "--queries", folder_.file("missing.csv")});
  EXPECT_EQ(outcome.code, cli::ExitCode::kNotFound) << outcome.err;
}

TEST_F(VerifyTest, QueriesByListHaveTheRowsOfQueriesByTheStructures) {
  const std::vector<std::string> line = {"-o", "ndjson", "query", "ball", "arena", "--at", "0,0,0", "--radius", "50"};
  const Outcome searched = run(line);
  std::vector<std::string> by_list = line;
  by_list.emplace_back("--by-list");
  const Outcome listed = run(by_list);
  EXPECT_EQ(listed.code, cli::ExitCode::kOk) << listed.err;
  EXPECT_NE(listed.out, "");
  EXPECT_EQ(listed.out, searched.out);
}

}  // namespace
}  // namespace locus::test
