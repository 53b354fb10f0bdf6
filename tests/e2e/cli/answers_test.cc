// Output of commands: shapes of objects, times of answers, acknowledgements in one line, and silence.
#include <sstream>

#include "client/cli/run.h"
#include "tests/support/cli_outcome.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using cli::Json;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

class AnswersTest : public RpcTest {
 protected:
  Outcome run(const std::vector<std::string>& arguments) { return run_cli(running_.address(), arguments); }

  std::string out_of(const std::vector<std::string>& arguments) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, cli::ExitCode::kOk) << outcome.err;
    return outcome.out;
  }
};

TEST_F(AnswersTest, GetShowsShapesAndTheirSizes) {
  out_of({"insert", "world", "point", "--id", "1", "--at", "0,0,0"});
  out_of({"insert", "world", "ball", "--id", "2", "--at", "0,0,0", "--radius", "0.5"});
  out_of({"insert", "world", "box", "--id", "3", "--at", "0,0,0", "--half", "1,2,3"});
  out_of({"insert", "world", "capsule", "--id", "4", "--at", "0,0,0", "--axis", "0,0,2", "--radius", "0.25"});
  out_of({"generate", "city", "--triangles", "600", "--scene", "world", "--mesh", "city", "--id", "5"});
  const Json answer = Json::parse(
      out_of({"-o", "json", "get", "world", "--id", "1", "--id", "2", "--id", "3", "--id", "4", "--id", "5"}), nullptr,
      /*allow_exceptions=*/false);
  std::vector<std::string> shapes;
  for (const Json& row : answer["things"]) {
    Json sizes = Json::object();
    for (const char* key : {"shape", "radius", "half", "axis", "scale"})
      if (!row[key].is_null()) sizes[key] = row[key];
    shapes.push_back(sizes.dump());
  }
  EXPECT_THAT(shapes, ::testing::ElementsAre(R"({"shape":"point"})", R"({"shape":"ball","radius":0.5})",
                                             R"({"shape":"box","half":[1.0,2.0,3.0]})",
                                             R"({"shape":"capsule","radius":0.25,"axis":[0.0,0.0,2.0]})",
                                             R"({"shape":"instance","scale":1.0})"));
}

TEST_F(AnswersTest, RowsOfQueriesAboutThePastHaveTheirTime) {
  out_of({"scene", "create", "past", "--history-ticks", "10"});
  for (const char* const tick : {"1", "2", "3"})
    out_of({"insert", "past", "ball", "--id", "1", "--at", std::string(tick) + ",0,0", "--radius", "0.5", "--upsert",
            "--tick", tick});
  const std::vector<std::string> ray = {"query", "ray",   "past",      "--from", "0,0,0",
                                        "--dir", "1,0,0", "--columns", "t,id"};
  const auto csv = [&](std::vector<std::string> line, const std::vector<std::string>& more) {
    line.insert(line.begin(), {"-o", "csv"});
    line.insert(line.end(), more.begin(), more.end());
    return out_of(line);
  };
  EXPECT_EQ(csv(ray, {}), "ray,hit,t,id\n0,true,2.5,1\n") << "without --as-of there is no such column";
  EXPECT_EQ(csv(ray, {"--as-of", "2"}), "ray,hit,t,id,as_of\n0,true,1.5,1,2\n");
  EXPECT_EQ(csv(ray, {"--as-of", "0", "--outside", "clamp"}).substr(0, 18), "ray,hit,t,id,as_of");
  EXPECT_EQ(csv({"query", "ray", "past", "--from", "0,0,0", "--dir", "1,0,0", "--mode", "any"}, {"--as-of", "2"}),
            "ray,hit,as_of\n0,true,2\n");
  EXPECT_EQ(csv({"query", "sight", "past", "--viewer", "0,0,0", "--target", "9,0,0"}, {"--as-of", "2"}),
            "viewer,target,seen,as_of\n0,0,0,2\n");
  EXPECT_THAT(csv({"get", "past", "--id", "1"}, {"--as-of", "2"}), HasSubstr(",as_of\n"));
}

TEST_F(AnswersTest, AChangeIsAcknowledgedInOneLine) {
  const std::vector<std::string> insert = {"insert", "world", "point", "--id", "1", "--at", "0,0,0"};
  EXPECT_EQ(out_of(insert), "1 applied, revision 1, tick 0\n");
  EXPECT_EQ(out_of({"move", "world", "--id", "1", "--to", "0,0,1"}), "1 applied, revision 2, tick 0\n");
  EXPECT_EQ(out_of({"remove", "world", "--id", "1"}), "1 applied, revision 3, tick 0\n");
  EXPECT_EQ(out_of({"-o", "csv", "insert", "world", "point", "--id", "1", "--at", "0,0,0"}).substr(0, 44),
            "applied,refused,revision,tick,epoch\n1,0,4,0,");
  const Outcome refused = run(insert);
  EXPECT_EQ(refused.code, cli::ExitCode::kFailed);
  EXPECT_THAT(refused.out, HasSubstr("DUPLICATE_ID")) << "refused items are a table";
}

TEST_F(AnswersTest, APictureIsAcknowledgedInOneLine) {
  out_of({"insert", "world", "ball", "--id", "1", "--at", "0,0,0", "--radius", "1"});
  const std::string path = ::testing::TempDir() + "answers_test.png";
  EXPECT_THAT(out_of({"render", "world", path, "--size", "32x24"}),
              ::testing::MatchesRegex(path + ": 32x24, [0-9]+ of 768 rays hit, [0-9.]+ s, revision 1\n"));
  EXPECT_THAT(out_of({"-q", "render", "world", path, "--size", "32x24"}), IsEmpty());
  std::remove(path.c_str());
}

TEST_F(AnswersTest, QuietWritesNoAcknowledgementsAndNoHints) {
  EXPECT_THAT(out_of({"-q", "insert", "world", "point", "--id", "1", "--at", "0,0,0"}), IsEmpty());
  EXPECT_THAT(out_of({"insert", "world", "point", "--id", "2", "--at", "0,0,0", "--quiet"}), IsEmpty());
  EXPECT_THAT(out_of({"-q", "-o", "json", "insert", "world", "point", "--id", "3", "--at", "0,0,0"}),
              HasSubstr("\"applied\": 1"))
      << "only tables are silent";
  EXPECT_THAT(out_of({"-q", "query", "ball", "world", "--at", "0,0,0", "--radius", "1"}), HasSubstr("ball"))
      << "answers stay";
  EXPECT_THAT(run({"scene", "describe", "no"}).err, HasSubstr("hint: "));
  const Outcome quiet = run({"-q", "scene", "describe", "no"});
  EXPECT_THAT(quiet.err, StartsWith("error: "));
  EXPECT_EQ(quiet.err.find("hint: "), std::string::npos);
  EXPECT_EQ(run({"-q", "scene", "describ", "no"}).err.find("hint: "), std::string::npos);
}

TEST_F(AnswersTest, ANegativeNumberIsAValueAndNoOption) {
  EXPECT_THAT(out_of({"-o", "csv", "query", "ray", "world", "--from", "-5,0,0", "--dir", "-1,-2,-3"}),
              HasSubstr("0,false"));
  out_of({"insert", "world", "point", "--id", "1", "--at", "-5,-6,-7"});
  for (const std::string option : {"--group", "--tag", "--id", "--layers"}) {
    const Outcome outcome = run({"insert", "world", "point", "--id", "9", "--at", "0,0,0", option, "-5"});
    EXPECT_EQ(outcome.code, cli::ExitCode::kUsage);
    EXPECT_THAT(outcome.err, StartsWith("error: " + option)) << "the message is about the value";
    EXPECT_THAT(outcome.err, HasSubstr("-5"));
  }
  EXPECT_THAT(run({"insert", "world", "point", "--id", "9", "--at", "0,0,0", "--group", "-5"}).err,
              StartsWith("error: --group GROUP: cannot read '-5': it cannot be negative\n"));
}

}  // namespace
}  // namespace locus::test
