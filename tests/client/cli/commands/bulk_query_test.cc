#include "client/cli/commands/bulk_query.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "tests/client/cli/bulk_fixture.h"
#include "tests/support/random.h"

namespace locus::cli {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr char kRayHeader[] = "from.x,from.y,from.z,dir.x,dir.y,dir.z\n";

class BulkQueryTest : public BulkTest {
 protected:
  // Inserts 1000 balls on a lattice of 10 x 10 x 10 points in one command.
  void insert_balls() {
    std::string rows = "id,at.x,at.y,at.z\n";
    for (int i = 0; i < 1000; ++i)
      absl::StrAppend(&rows, i + 1, ",", i % 10 * 4, ",", i / 10 % 10 * 4, ",", i / 100 * 4, "\n");
    const TestFile file(rows, "balls.csv");
    out_of({"insert", "world", "ball", "--from-csv", file.path(), "--radius", "1"});
  }
};

// Returns random rays. The coordinates of their origins are multiples of 1/8 and hence exact floats, so that the
// command uses no frame, neither for rays given by options nor for rays read from rows.
std::vector<std::array<double, 6>> random_rays(int count) {
  test::Random random(17);
  std::vector<std::array<double, 6>> rays;
  const auto eighths = [&](int limit) { return random.whole(-limit, limit) / 8.0; };
  for (int i = 0; i < count; ++i) {
    rays.push_back({eighths(300), eighths(300), eighths(300), eighths(8), eighths(8), eighths(8) + 1.0625});
  }
  return rays;
}

TEST_F(BulkQueryTest, AHundredThousandRaysFromAPipeGetTheSameAnswersAsFromOptions) {
  insert_balls();
  constexpr int kRays = 100000;
  constexpr int kChunk = 1000;
  const std::vector<std::array<double, 6>> rays = random_rays(kRays);
  NamedPipe pipe;
  std::thread writer([&] {
    pipe.write(kRayHeader);
    for (const auto& r : rays) {
      pipe.write(absl::StrCat(r[0], ",", r[1], ",", r[2], ",", r[3], ",", r[4], ",", r[5], "\n"));
    }
    pipe.close();
  });
  const std::string all = out_of({"-o", "ndjson", "query", "ray", "world", "--from-csv", pipe.path()});
  writer.join();
  const std::vector<std::string> lines = absl::StrSplit(all, '\n', absl::SkipEmpty());
  ASSERT_EQ(lines.size(), static_cast<size_t>(kRays));
  size_t hits = 0;
  for (int begin = 0; begin < kRays; begin += kChunk) {
    std::vector<std::string> line = {"-o", "ndjson", "query", "ray", "world"};
    for (int i = begin; i < begin + kChunk; ++i) {
      const auto& r = rays[static_cast<size_t>(i)];
      line.insert(line.end(), {absl::StrCat("--from=", r[0], ",", r[1], ",", r[2]),
                               absl::StrCat("--dir=", r[3], ",", r[4], ",", r[5])});
    }
    const std::vector<std::string> expected = absl::StrSplit(out_of(line), '\n', absl::SkipEmpty());
    ASSERT_EQ(expected.size(), static_cast<size_t>(kChunk));
    for (int i = 0; i < kChunk; ++i) {
      const std::string& row = lines[static_cast<size_t>(begin + i)];
      const std::string number = absl::StrCat("{\"ray\":", begin + i, ",");
      ASSERT_THAT(row, StartsWith(number));
      ASSERT_EQ(row.substr(number.size()),
                expected[static_cast<size_t>(i)].substr(absl::StrCat("{\"ray\":", i, ",").size()));
      hits += row.find("\"hit\":true") != std::string::npos ? 1 : 0;
    }
  }
  EXPECT_GT(hits, 1000u) << "the comparison must be about something";
}

TEST_F(BulkQueryTest, AnswersDoNotDependOnWhereBatchesEnd) {
  insert_balls();
  test::Random random(3);
  std::string rows = kRayHeader;
  for (int i = 0; i < 3000; ++i) {
    const double far = i % 7 == 0 ? 1e6 : i % 11 == 0 ? -4e7 : 0;
    absl::StrAppendFormat(&rows, "%.2f,%.2f,-5.1,0,0,1\n", random.between(0, 40) + far, random.between(0, 40));
  }
  const TestFile file(rows);
  const auto answers = [&](const std::string& batch) {
    return out_of({"-o", "csv", "query", "ray", "world", "--from-csv", file.path(), "--batch", batch});
  };
  const std::string whole = answers("65536");
  EXPECT_THAT(whole, HasSubstr(",true,"));
  EXPECT_EQ(answers("1000"), whole);
  EXPECT_EQ(answers("7"), whole);
}

TEST_F(BulkQueryTest, EveryKindAndModeAcceptsRows) {
  insert_balls();
  const TestFile rays("{\"from\":[0,0,-9],\"dir\":[0,0,1]}\n{\"from\":[2,2,-9],\"dir\":[0,0,1]}\n", "rays.ndjson");
  EXPECT_EQ(out_of({"-o", "csv", "query", "ray", "world", "--from-ndjson", rays.path(), "--mode", "any"}),
            "ray,hit\n0,true\n1,false\n");
  const Json all =
      json_of({"query", "ray", "world", "--from-ndjson", rays.path(), "--mode", "all", "--columns", "point"});
  ASSERT_EQ(all["hits"].size(), 10u);
  EXPECT_EQ(all["hits"][9]["point"], Json::parse("[0.0,0.0,35.0]"));
  const TestFile balls("at.x,at.y,at.z,radius,mask,ignore_group\n0,0,0,1,,\n0,0,0,1,2,\n4,0,0,0,1,9\n", "at.csv");
  EXPECT_EQ(out_of({"-o", "csv", "query", "ball", "world", "--from-csv", balls.path()}), "ball,id\n0,1\n2,2\n");
  const TestFile boxes("{\"position\":[4,0,0]}\n", "boxes.ndjson");
  EXPECT_EQ(out_of({"-o", "ndjson", "query", "box", "world", "--from-ndjson", boxes.path(), "--half", "1,1,1"}),
            "{\"box\":0,\"id\":\"2\"}\n");
  const TestFile points("at.x,at.y,at.z,max_distance\n3.5,0,0,\n2,2,0,0.5\n8,0,0,9\n", "points.csv");
  EXPECT_EQ(out_of({"-o", "csv", "query", "nearest", "world", "--from-csv", points.path(), "--columns", "triangle"}),
            "query,t,id,triangle\n0,0.0,2,\n2,0.0,3,\n");
}

TEST_F(BulkQueryTest, RowsFilterByGroupTagAndId) {
  insert_balls();
  const TestFile balls(
      "at.x,at.y,at.z,radius,self_id,only_group,tag,tag_mask\n0,0,0,1,,,,\n0,0,0,1,1,,,\n0,0,0,1,,77,,\n0,0,0,1,,,"
      "12345,\n"
      "0,0,0,1,,,12345,0\n",
      "at.csv");
  EXPECT_EQ(out_of({"-o", "csv", "query", "ball", "world", "--from-csv", balls.path()}), "ball,id\n0,1\n4,1\n");
  const TestFile plain("at.x,at.y,at.z,radius\n0,0,0,1\n", "plain.csv");
  EXPECT_EQ(out_of({"-o", "csv", "query", "ball", "world", "--from-csv", plain.path(), "--only-group", "77",
                    "--only-group", "78"}),
            "ball,id\n");
  EXPECT_EQ(
      out_of({"-o", "csv", "query", "ball", "world", "--from-csv", plain.path(), "--tag", "12345", "--tag-mask", "0"}),
      "ball,id\n0,1\n");
  const TestFile masks("at.x,at.y,at.z,radius,tag,tag_mask\n0,0,0,1,5,7\n0,0,0,1,,7\n", "masks.csv");
  EXPECT_THAT(run({"query", "ball", "world", "--from-csv", masks.path()}).err,
              HasSubstr(masks.path() + ":3: tag_mask: needs a value of tag in the same row"));
}

TEST_F(BulkQueryTest, AJsonAnswerIsTheSameDocumentAsFromOptions) {
  insert_balls();
  const TestFile rows("{\"at\":[0,0,0]}\n{\"at\":[4,0,0]}\n", "at.ndjson");
  const Json bulk = json_of({"query", "ball", "world", "--from-ndjson", rows.path(), "--radius", "1", "--batch", "1"});
  EXPECT_EQ(bulk, json_of({"query", "ball", "world", "--at", "0,0,0", "--at", "4,0,0", "--radius", "1"}));
}

TEST_F(BulkQueryTest, AnswersAreWrittenBeforeTheInputEndsAndAtTheRevisionOfTheFirst) {
  NamedPipe pipe;
  SharedText text;
  std::thread command([&] {
    std::ostream out(&text);
    std::ostringstream err;
    EXPECT_EQ(run_into({"-o", "csv", "query", "ball", "world", "--from-csv", pipe.path(), "--radius", "1"}, out, err),
              ExitCode::kOk)
        << err.str();
  });
  out_of({"insert", "world", "point", "--id", "1", "--at", "0,0,0"});
  pipe.write("at.x,at.y,at.z\n0,0,0\n");
  EXPECT_TRUE(text.wait_for("0,1\n"));
  out_of({"insert", "world", "point", "--id", "2", "--at", "9,0,0"});
  pipe.write("9,0,0\n0,0,0\n");
  EXPECT_TRUE(text.wait_for("2,1\n"));
  pipe.close();
  command.join();
  EXPECT_EQ(text.text(), "ball,id\n0,1\n2,1\n") << "object 2 came later than the first answer";
}

TEST_F(BulkQueryTest, WithFollowLaterRowsSeeNewerRevisions) {
  NamedPipe pipe;
  SharedText text;
  std::thread command([&] {
    std::ostream out(&text);
    std::ostringstream err;
    run_into({"-o", "json", "query", "ball", "world", "--from-csv", pipe.path(), "--radius", "1", "--follow"}, out,
             err);
  });
  out_of({"insert", "world", "point", "--id", "1", "--at", "0,0,0"});
  pipe.write("at.x,at.y,at.z\n0,0,0\n");
  EXPECT_TRUE(text.wait_for("\"id\":\"1\""));
  out_of({"insert", "world", "point", "--id", "2", "--at", "9,0,0"});
  pipe.write("9,0,0\n");
  EXPECT_TRUE(text.wait_for("\"id\":\"2\""));
  pipe.close();
  command.join();
  const Json answer = Json::parse(text.text());
  EXPECT_EQ(answer["first_revision"], 1);
  EXPECT_EQ(answer["revision"], 2);
}

TEST_F(BulkQueryTest, ADroppedRevisionEndsTheRunWithTheCountOfAnsweredRows) {
  NamedPipe pipe;
  SharedText text;
  std::ostringstream err;
  ExitCode code = ExitCode::kOk;
  std::thread command([&] {
    std::ostream out(&text);
    code = run_into({"-o", "csv", "query", "ball", "world", "--from-csv", pipe.path(), "--radius", "1"}, out, err);
  });
  out_of({"insert", "world", "point", "--id", "1", "--at", "0,0,0"});
  pipe.write("at.x,at.y,at.z\n0,0,0\n");
  EXPECT_TRUE(text.wait_for("0,1\n"));
  std::string moves = "id,to.x,to.y,to.z\n";
  for (int i = 0; i < 200; ++i) absl::StrAppend(&moves, "1,", i, ",0,0\n");
  const TestFile file(moves, "moves.csv");
  EXPECT_EQ(json_of({"move", "world", "--from-csv", file.path(), "--batch", "1"})["batches"], 200);
  pipe.write("0,0,0\n");
  pipe.close();
  command.join();
  EXPECT_EQ(code, ExitCode::kFailed);
  EXPECT_THAT(err.str(),
              AllOf(HasSubstr(pipe.path() + ":3: "), HasSubstr("answered at revision 1; --follow lets later"),
                    HasSubstr("; 1 rows before it were answered")));
}

TEST_F(BulkQueryTest, AWrongRowEndsTheRunAfterTheAnswersOfEarlierBatches) {
  const TestFile file(absl::StrCat(kRayHeader, "0,0,0,0,0,1\n1,0,0,0,0,1\n2,0,0,0,0,1\n3,0,0,0,abc,1\n"));
  const BulkOutcome outcome =
      run({"-o", "csv", "query", "ray", "world", "--from-csv", file.path(), "--batch", "2", "--mode", "any"});
  EXPECT_EQ(outcome.code, ExitCode::kFailed);
  EXPECT_EQ(outcome.out, "ray,hit\n0,false\n1,false\n");
  EXPECT_EQ(outcome.err,
            absl::StrCat("error: ", file.path(), ":5: dir.y: 'abc' is no number; 2 rows before it were answered\n"));
}

TEST_F(BulkQueryTest, AValueThatTheServerRefusesIsNamedByItsLine) {
  const TestFile file(absl::StrCat(kRayHeader, "0,0,0,0,0,1\n1000000.1,0,0,0,0,1\n\n1000000.2,0,0,0,0,0\n"));
  const BulkOutcome outcome = run({"query", "ray", "world", "--from-csv", file.path()});
  EXPECT_EQ(outcome.code, ExitCode::kFailed);
  EXPECT_THAT(outcome.err, HasSubstr(file.path() + ":5: "));
}

TEST_F(BulkQueryTest, AnInputWithoutRowsIsAnsweredEmpty) {
  const TestFile header(kRayHeader);
  EXPECT_THAT(out_of({"-o", "csv", "query", "ray", "world", "--from-csv", header.path()}),
              AllOf(StartsWith("ray,hit,t,id,"), EndsWith("normal.z\n")));
  const TestFile empty("", "rows.ndjson");
  EXPECT_EQ(json_of({"query", "ray", "world", "--from-ndjson", empty.path()})["hits"].size(), 0u);
  EXPECT_EQ(run({"query", "ray", "nowhere", "--from-ndjson", empty.path()}).code, ExitCode::kNotFound);
}

TEST_F(BulkQueryTest, TruncatedQueriesAreCountedAndTheFirstIsNamed) {
  insert_balls();
  const TestFile rows("{\"at\":[99,0,0]}\n{\"at\":[0,0,0]}\n", "at.ndjson");
  const std::vector<std::string> line = {"query", "ball",          "world", "--from-ndjson", rows.path(), "--radius",
                                         "9",     "--max-results", "2"};
  EXPECT_EQ(json_of(line)["truncated"].dump(), "[1]");
  std::vector<std::string> csv = line;
  csv.insert(csv.begin(), {"-o", "csv"});
  const BulkOutcome outcome = run(csv);
  EXPECT_EQ(outcome.out, "ball,id\n1,1\n1,2\n");
  EXPECT_EQ(
      outcome.err,
      "warning: 1 rows found more than was reported, the first is ball 1: raise --max-results or lower --batch\n");
}

TEST_F(BulkQueryTest, AnOutputThatCannotBeWrittenEndsTheRun) {
  class Closed : public std::streambuf {};
  const TestFile rows("{\"at\":[0,0,0]}\n", "at.ndjson");
  Closed closed;
  std::ostream out(&closed);
  std::ostringstream err;
  EXPECT_EQ(run_into({"-o", "csv", "query", "ball", "world", "--from-ndjson", rows.path(), "--radius", "9"}, out, err),
            ExitCode::kFailed);
  EXPECT_THAT(err.str(), HasSubstr("cannot write the output"));
}

TEST_F(BulkQueryTest, OptionsThatExcludeEachOtherAreUsageErrors) {
  const TestFile file(kRayHeader);
  const std::string& path = file.path();
  for (const std::vector<std::string>& line : std::vector<std::vector<std::string>>{
           {"query", "ray", "world", "--from-csv", path, "--from-ndjson", path},
           {"query", "ray", "world", "--from-csv", path, "--from", "0,0,0"},
           {"query", "ray", "world", "--from-csv", path, "--dir", "0,0,1", "--dir", "0,0,2"},
           {"query", "ray", "world", "--from-csv", path, "--batch", "0"},
           {"query", "ray", "world", "--from-csv", path, "--batch", "65537"},
           {"query", "ray", "world", "--from-csv", path, "--exactly", "1", "--follow"},
           {"query", "ray", "world", "--from", "0,0,0", "--dir", "0,0,1", "--batch", "5"},
           {"query", "ray", "world", "--from", "0,0,0", "--dir", "0,0,1", "--follow"},
           {"query", "ball", "world", "--from-csv", path, "--after-id", "5"},
           {"query", "ball", "world", "--radius", "5"},
           {"query", "box", "world", "--at", "0,0,0"}}) {
    const BulkOutcome outcome = run(line);
    EXPECT_EQ(outcome.code, ExitCode::kUsage) << ::testing::PrintToString(line) << outcome.err;
  }
}

TEST_F(BulkQueryTest, AColumnBesideItsOptionAndAMissingFileAreReported) {
  const TestFile file(kRayHeader);
  EXPECT_THAT(run({"query", "ray", "world", "--from-csv", file.path(), "--dir", "0,0,1"}).err,
              HasSubstr(file.path() + ":1: the column dir and the option --dir are both given: leave one of them out"));
  EXPECT_EQ(run({"query", "ray", "world", "--from-csv", "/nonexistent/rays.csv"}).code, ExitCode::kNotFound);
}

TEST(FrameOfTest, FloatsAndPositionsNearTheOriginHaveTheOriginAsFrame) {
  EXPECT_EQ(frame_of(1e8, 0, 0).x, 0);
  EXPECT_EQ(frame_of(8000.1, -8000.1, 0).x, 0);
  EXPECT_EQ(frame_of(1000000.1, 0, 0).x, 999424);
}

}  // namespace
}  // namespace locus::cli
