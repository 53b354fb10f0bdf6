#include "client/cli/commands/query_command.h"

#include <string>
#include <vector>

#include "tests/client/cli/bulk_fixture.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;

// Fixture with three objects: ball 7 of group 3 at the origin and ball 8 of group 4 at x = 5, both of radius 1, and box
// 9 at z = -10.
class QueryCommandTest : public BulkTest {
 protected:
  void SetUp() override {
    BulkTest::SetUp();
    out_of({"insert", "world", "ball", "--id", "7", "--at", "0,0,0", "--radius", "1", "--group", "3"});
    out_of({"insert", "world", "ball", "--id", "8", "--at", "5,0,0", "--radius", "1", "--group", "4"});
    out_of({"insert", "world", "box", "--id", "9", "--at", "0,0,-10", "--half", "1,1,1"});
  }

  // Returns the rows of `locus -o csv query ...`, with a header.
  std::string csv_of(std::vector<std::string> line) const {
    line.insert(line.begin(), {"-o", "csv", "query"});
    return out_of(line);
  }

  std::string refusal_of(std::vector<std::string> line) const {
    line.insert(line.begin(), "query");
    const BulkOutcome outcome = run(line);
    EXPECT_EQ(outcome.code, ExitCode::kUsage) << outcome.out;
    return outcome.err;
  }
};

TEST_F(QueryCommandTest, ASweepStopsWhereItTouches) {
  EXPECT_EQ(csv_of({"sweep", "world", "--from=-5,0,0", "--to=5,0,0", "--radius", "0.5", "--columns", "normal"}),
            "sweep,hit,t,id,normal.x,normal.y,normal.z\n0,true,0.35,7,-1.0,0.0,0.0\n");
  EXPECT_EQ(csv_of({"sweep", "world", "--from=-5,9,0", "--to=5,9,0", "--half", "1,1,1", "--mode", "any"}),
            "sweep,hit\n0,false\n");
  EXPECT_EQ(
      csv_of({"sweep", "world", "--from=-5,0,0", "--to=5,0,0", "--radius", "0.5", "--mode", "all", "--columns", "id"}),
      "sweep,t,id\n0,0.35,7\n0,0.85,8\n");
}

TEST_F(QueryCommandTest, SweepsAtTheStartHitOrPass) {
  const auto from_the_ball = [&](const std::string& at_start) {
    return csv_of({"sweep", "world", "--from", "1.25,0,0", "--to=-5,0,0", "--radius", "0.5", "--at-start", at_start,
                   "--columns", "id"});
  };
  EXPECT_EQ(from_the_ball("hit"), "sweep,hit,t,id\n0,true,0.0,7\n");
  EXPECT_EQ(from_the_ball("pass"), "sweep,hit,t,id\n0,false,,\n");
}

TEST_F(QueryCommandTest, CapsulesHaveContacts) {
  EXPECT_EQ(csv_of({"capsule", "world", "--from", "0,0,1.25", "--to", "0,0,3", "--radius", "0.5", "--columns", "t"}),
            "capsule,id,t\n0,7,0.25\n");
}

TEST_F(QueryCommandTest, AFrustumIsGivenByPlanesOrByAMatrix) {
  EXPECT_EQ(csv_of({"frustum", "world", "--plane=1,0,0,-4", "--plane=-1,0,0,9", "--plane=0,1,0,9", "--plane=0,-1,0,9"}),
            "frustum,id\n0,8\n");
  // The matrix maps x and y to a quarter of their values, and z to the depth (z + 4) / 8.
  const std::string view = "0.25,0,0,0,0,0.25,0,0,0,0,0.125,0,0,0,0.5,1";
  EXPECT_EQ(csv_of({"frustum", "world", "--view", view}), "frustum,id\n0,7\n0,8\n");
  EXPECT_THAT(refusal_of({"frustum", "world"}), HasSubstr("give --plane, --view with 16 numbers"));
}

TEST_F(QueryCommandTest, ContainsNamesWhatAPointIsIn) {
  EXPECT_EQ(csv_of({"contains", "world", "--at", "0,0,0.5", "--at", "2,2,2", "--at", "0,0,-10"}),
            "query,id\n0,7\n2,9\n");
}

TEST_F(QueryCommandTest, SightPassesTheGroupsOfViewerAndTarget) {
  const std::vector<std::string> line = {"sight", "world", "--viewer=-3,0,0", "--target", "8,0,0"};
  EXPECT_EQ(csv_of(line), "viewer,target,seen\n0,0,0\n");
  std::vector<std::string> with_groups = line;
  with_groups.insert(with_groups.end(), {"--viewer-group", "3", "--target-group", "4"});
  EXPECT_EQ(csv_of(with_groups), "viewer,target,seen\n0,0,1\n");
  EXPECT_EQ(csv_of({"sight", "world", "--viewer=-3,0,0", "--target", "8,0,0", "--target=-3,9,0", "--samples", "2"}),
            "viewer,target,seen\n0,0,1\n");
  EXPECT_THAT(refusal_of({"sight", "world", "--viewer", "0,0,0"}), HasSubstr("give --viewer and --target"));
}

TEST_F(QueryCommandTest, PairsAreListedOnceAndContinued) {
  EXPECT_EQ(csv_of({"pairs", "world", "--max-distance", "3"}), "id,other,t\n7,8,3.0\n");
  EXPECT_EQ(csv_of({"pairs", "world", "--max-distance", "2.5"}), "id,other,t\n");
  EXPECT_EQ(
      csv_of({"pairs", "world", "--max-distance", "20", "--after-id", "7", "--after-other", "8", "--columns", "id"}),
      "id,other,t\n7,9,8.0\n8,9,8.848858\n");
}

TEST_F(QueryCommandTest, ACellBeginsWithItsBallAndHasAPlaneForEachNeighbour) {
  const Json cell =
      json_of({"query", "cell", "world", "--at", "2.5,0,0", "--max-distance", "4", "--columns", "normal"});
  ASSERT_EQ(cell["planes"].size(), 3u) << cell;
  EXPECT_EQ(cell["planes"][0]["t"], 4.0);
  EXPECT_EQ(cell["planes"][1]["id"], "7");
  EXPECT_EQ(cell["planes"][1]["t"], 1.5);
  EXPECT_EQ(cell["planes"][1]["normal"], Json::parse("[-1.0,0.0,0.0]"));
  EXPECT_EQ(cell["planes"][2]["id"], "8");
}

TEST_F(QueryCommandTest, AnAnchorIsTheOriginAndIsPassedOver) {
  EXPECT_EQ(
      csv_of({"ball", "world", "--at", "0,0,0", "--at", "0,0,0", "--anchor", "8", "--anchor", "7", "--radius", "5"}),
      "ball,id\n0,7\n1,8\n");
  const Json unknown = json_of({"query", "ball", "world", "--at", "0,0,0", "--anchor", "99", "--radius", "5"});
  EXPECT_EQ(unknown["unanchored"], Json::parse("[0]"));
  EXPECT_TRUE(unknown["found"].empty());
}

TEST_F(QueryCommandTest, CountOnlyReturnsNumbersInsteadOfRows) {
  EXPECT_EQ(
      csv_of({"ball", "world", "--at", "0,0,0", "--at", "0,0,0", "--radius", "100", "--radius", "1", "--count-only"}),
      "ball,count\n0,3\n1,1\n");
}

TEST_F(QueryCommandTest, RowsOfAFileAreAnsweredLikeOptions) {
  const TestFile sweeps("{\"from\":[-5,0,0],\"way\":[10,0,0]}\n{\"from\":[-5,9,0],\"way\":[10,0,0]}\n",
                        "sweeps.ndjson");
  EXPECT_EQ(csv_of({"sweep", "world", "--from-ndjson", sweeps.path(), "--radius", "0.5", "--columns", "id"}),
            "sweep,hit,t,id\n0,true,0.35,7\n1,false,,\n");
  const TestFile sight(
      "viewer.x,viewer.y,viewer.z,target.x,target.y,target.z,viewer_group,target_group,max_distance\n"
      "-3,0,0,8,0,0,,,\n-3,0,0,8,0,0,3,4,\n-3,0,0,8,0,0,3,4,10\n1000000.1,0,0,1000000.1,5,0,,,\n",
      "sight.csv");
  EXPECT_EQ(csv_of({"sight", "world", "--from-csv", sight.path()}), "sight,seen\n0,false\n1,true\n2,false\n3,true\n");
  const TestFile views(
      "{\"view\":[0.25,0,0,0,0,0.25,0,0,0,0,0.125,0,0,0,0.5,1]}\n"
      "{\"view\":[1,0,0,0,0,1,0,0,0,0,0.5,0,0,0,0.5,1]}\n",
      "views.ndjson");
  EXPECT_EQ(csv_of({"frustum", "world", "--from-ndjson", views.path()}), "frustum,id\n0,7\n0,8\n1,7\n");
  const TestFile inside("at.x,at.y,at.z\n2.5,0,0\n0,0,0.5\n", "inside.csv");
  const TestFile points("at.x,at.y,at.z,max_distance\n2.5,0,0,4\n0,0,0.5,4\n", "points.csv");
  EXPECT_EQ(csv_of({"contains", "world", "--from-csv", inside.path()}), "query,id\n1,7\n");
  EXPECT_EQ(csv_of({"cell", "world", "--from-csv", points.path(), "--columns", "id"}),
            "cell,t,id\n0,4.0,\n0,1.5,7\n0,1.5,8\n");
  EXPECT_THAT(refusal_of({"sight", "world", "--from-csv", sight.path(), "--viewer", "0,0,0"}), HasSubstr("not both"));
}

}  // namespace
}  // namespace locus::cli
