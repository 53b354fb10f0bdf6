#include "client/cli/commands/bulk_update.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <thread>

#include "absl/strings/str_cat.h"
#include "tests/client/cli/bulk_fixture.h"
#include "tests/client/lib/fake_server.h"

namespace locus::cli {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class BulkUpdateTest : public BulkTest {
 protected:
  std::string position_of(const std::string& id) const {
    return json_of({"get", "world", "--id", id})["things"][0]["position"].dump();
  }
};

TEST_F(BulkUpdateTest, AHundredThousandObjectsAreInsertedMovedAndRemoved) {
  constexpr int kObjects = 100000;
  std::string inserts = "id,at.x,at.y,at.z\n";
  std::string moves;
  std::string ids = "id\n";
  for (int i = 1; i <= kObjects; ++i) {
    absl::StrAppend(&inserts, i, ",", i, ",0,0\n");
    absl::StrAppend(&moves, "{\"id\":\"", i, "\",\"to\":[", i, ",0.1,-2]}\n");
    absl::StrAppend(&ids, i, "\n");
  }
  const TestFile insert_file(inserts, "insert.csv");
  const TestFile id_file(ids, "ids.csv");
  const Json inserted = json_of({"insert", "world", "point", "--from-csv", insert_file.path()});
  EXPECT_EQ(inserted["applied"], kObjects);
  EXPECT_EQ(inserted["batches"], 13) << "8,192 a batch";
  EXPECT_EQ(inserted["revision"], 13) << "each batch is one revision";
  NamedPipe pipe;
  std::thread writer([&] {
    pipe.write(moves);
    pipe.close();
  });
  EXPECT_EQ(json_of({"move", "world", "--from-ndjson", pipe.path()})["applied"], kObjects);
  writer.join();
  for (const int id : {1, 8192, 8193, 50000, kObjects}) {
    EXPECT_EQ(position_of(absl::StrCat(id)), absl::StrCat("[", id, ".0,0.1,-2.0]"));
  }
  EXPECT_EQ(json_of({"scene", "describe", "world"})["objects"], kObjects);
  EXPECT_EQ(json_of({"remove", "world", "--from-csv", id_file.path(), "--batch", "65536"})["batches"], 2);
  EXPECT_EQ(json_of({"scene", "describe", "world"})["objects"], 0);
}

TEST_F(BulkUpdateTest, MovesFromAPipeAreAppliedAsSoonAsItPauses) {
  out_of({"insert", "world", "point", "--id", "18446744073709551615", "--at", "0,0,0"});
  NamedPipe pipe;
  std::ostringstream out;
  std::ostringstream err;
  std::thread command([&] {
    EXPECT_EQ(run_into({"move", "world", "--from-ndjson", pipe.path()}, out, err), ExitCode::kOk) << err.str();
  });
  pipe.write("{\"id\":18446744073709551615,\"to\":[1,2,3]}\n");
  bool moved = false;
  for (int i = 0; i < 3000 && !moved; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    moved = position_of("18446744073709551615") == "[1.0,2.0,3.0]";
  }
  EXPECT_TRUE(moved) << "while the pipe is open";
  pipe.close();
  command.join();
}

TEST_F(BulkUpdateTest, RefusedItemsAreListedByLine) {
  out_of({"insert", "world", "point", "--id", "1", "--at", "0,0,0"});
  const TestFile file(
      "id,to.x,to.y,to.z,rotation.x,rotation.y,rotation.z,rotation.w\n"
      "1,1,0,0,,,,\n\n8,1,0,0,0,0,0,1\n1,2,0,0,0,0,0,1\n9,1,0,0,,,,\n");
  const BulkOutcome outcome = run({"-o", "csv", "move", "world", "--from-csv", file.path()});
  EXPECT_EQ(outcome.code, ExitCode::kNotFound);
  EXPECT_EQ(outcome.out, "line,id,reason\n4,8,UNKNOWN_ID\n6,9,UNKNOWN_ID\n");
  EXPECT_THAT(outcome.err,
              HasSubstr(absl::StrCat("2 of 4 rows refused; the first is ", file.path(), ":4, id 8: UNKNOWN_ID")));
  EXPECT_EQ(position_of("1"), "[2.0,0.0,0.0]");
  EXPECT_EQ(json_of({"scene", "describe", "world"})["revision"], 2);
}

TEST_F(BulkUpdateTest, AWrongRowStopsItsBatchAndTheAppliedRowsAreCounted) {
  const TestFile file("{\"id\":1,\"at\":[0,0,0]}\n{\"id\":2,\"at\":[0,0,0]}\n{\"id\":3,\"at\":[0,0,0]}\n{\"id\":4}\n",
                      "rows.ndjson");
  const BulkOutcome outcome = run({"insert", "world", "point", "--from-ndjson", file.path(), "--batch", "2"});
  EXPECT_EQ(outcome.code, ExitCode::kFailed);
  EXPECT_THAT(outcome.err,
              HasSubstr(absl::StrCat("error: ", file.path(),
                                     ":4: at: is missing; of the rows sent 2 were applied and 0 refused\n")));
  EXPECT_THAT(outcome.out, HasSubstr("2 applied, revision "));
  EXPECT_EQ(json_of({"scene", "describe", "world"})["objects"], 2);
}

TEST_F(BulkUpdateTest, MixedShapesKeepTheirMeasuresAndLabels) {
  const TestFile file(R"({"shape":"ball","id":"1","position":[0,0,0],"radius":2,"group":"5","tag":"6","layers":4})"
                      "\n"
                      R"({"shape":"box","id":2,"at":[10,0,0],"half_extents":[1,2,3],"rotation":[0,0,0,1]})"
                      "\n"
                      R"({"shape":"point","id":3,"at":[20,0,0],"radius":null})"
                      "\n"
                      R"({"shape":"capsule","id":4,"at":[30,0,0],"half_axis":[0,5,0],"radius":1})"
                      "\n",
                      "rows.ndjson");
  EXPECT_EQ(json_of({"insert", "world", "mixed", "--from-ndjson", file.path()})["applied"], 4);
  const auto touched = [&](const std::string& at) {
    return out_of(
        {"-o", "ndjson", "query", "ball", "world", "--at", at, "--radius", "0.5", "--columns", "group,tag,layers"});
  };
  EXPECT_EQ(touched("2.25,0,0"), "{\"ball\":0,\"id\":\"1\",\"group\":\"5\",\"tag\":\"6\",\"layers\":4}\n");
  EXPECT_EQ(touched("10,2.25,0"), "{\"ball\":0,\"id\":\"2\",\"group\":\"0\",\"tag\":\"0\",\"layers\":1}\n");
  EXPECT_EQ(touched("20,0.25,0"), "{\"ball\":0,\"id\":\"3\",\"group\":\"0\",\"tag\":\"0\",\"layers\":1}\n");
  EXPECT_EQ(touched("30,6.25,0"), "{\"ball\":0,\"id\":\"4\",\"group\":\"0\",\"tag\":\"0\",\"layers\":1}\n");
}

TEST_F(BulkUpdateTest, WrongMeasuresOfAShapeAreReportedWithTheirLine) {
  const auto refusal = [&](const std::string& shape, const std::string& rows) {
    const TestFile file(rows);
    const BulkOutcome outcome = run({"insert", "world", shape, "--from-csv", file.path()});
    EXPECT_EQ(outcome.code, ExitCode::kFailed) << rows;
    return outcome.err;
  };
  EXPECT_THAT(refusal("ball", "id,at.x,at.y,at.z\n1,0,0,0\n"), HasSubstr(":2: radius: is missing; a ball needs it"));
  EXPECT_THAT(refusal("point", "id,at.x,at.y,at.z,radius\n1,0,0,0,\n2,0,0,0,1\n"),
              HasSubstr(":3: a point has no radius"));
  EXPECT_THAT(refusal("point", "shape,id,at.x,at.y,at.z\nball,1,0,0,0\n"),
              HasSubstr(":2: shape: is ball, and the command says point; `mixed` takes every shape"));
  EXPECT_THAT(refusal("mixed", "id,at.x,at.y,at.z\n1,0,0,0\n"), HasSubstr(":1: no column shape; "));
  EXPECT_THAT(refusal("mixed", "shape,id,at.x,at.y,at.z\ncone,1,0,0,0\n"),
              HasSubstr(":2: shape: 'cone' is none of point, ball"));
}

TEST_F(BulkUpdateTest, ARefusedBatchIsReportedWithItsLines) {
  const TestFile file("id,at.x,at.y,at.z\n1,0,0,0\n2,0,0,0\n");
  const BulkOutcome outcome = run({"insert", "nowhere", "point", "--from-csv", file.path()});
  EXPECT_EQ(outcome.code, ExitCode::kNotFound);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr(file.path() + ":2-3: "), HasSubstr("; nothing was applied")));
}

TEST_F(BulkUpdateTest, RowsWithoutAnAnswerAreNotReportedAsNotApplied) {
  client::testing::FakeServer server;
  server.updates.breaks = {.after_messages = 2,
                           .times = 1,
                           .apply_last = true,
                           .status = grpc::Status(grpc::StatusCode::PERMISSION_DENIED, "planned")};
  const TestFile file("id,at.x,at.y,at.z\n1,0,0,0\n2,0,0,0\n3,0,0,0\n");
  std::ostringstream out, err;
  Context context(out, err, Progress::kSilent);
  EXPECT_EQ(
      run_line({"--address", server.address(), "insert", "world", "point", "--batch", "2", "--from-csv", file.path()},
               context),
      ExitCode::kDenied);
  EXPECT_THAT(err.str(), HasSubstr("; whether 1 other rows were applied is not known"));
}

TEST_F(BulkUpdateTest, AnInputWithoutRowsReportsTheRevision) {
  const TestFile header("id,to.x,to.y,to.z\n");
  const Json answer = json_of({"move", "world", "--from-csv", header.path()});
  EXPECT_EQ(answer["applied"], 0);
  EXPECT_EQ(answer["revision"], 0);
}

TEST_F(BulkUpdateTest, AllRowsBecomeOneRevision) {
  std::string rows = "id,at.x,at.y,at.z\n";
  for (int i = 1; i <= 20000; ++i) absl::StrAppend(&rows, i, ",", i, ",0,0\n");
  const TestFile file(rows, "rows.csv");
  const Json inserted =
      json_of({"insert", "world", "point", "--from-csv", file.path(), "--one-revision", "--tick", "7"});
  EXPECT_EQ(inserted["applied"], 20000);
  EXPECT_EQ(inserted["revision"], 1);
  EXPECT_EQ(inserted["tick"], 7);
  EXPECT_EQ(json_of({"scene", "describe", "world"})["objects"], 20000);
}

TEST_F(BulkUpdateTest, RefusedItemsOfOneRevisionAreListedByTheirLine) {
  out_of({"insert", "world", "point", "--id", "1", "--at", "0,0,0"});
  const TestFile file("id,to.x,to.y,to.z\n1,1,0,0\n1,2,0,0\n1,3,0,0\n8,1,0,0\n1,4,0,0\n");
  const BulkOutcome outcome =
      run({"-o", "csv", "move", "world", "--from-csv", file.path(), "--batch", "2", "--one-revision"});
  EXPECT_EQ(outcome.code, ExitCode::kNotFound);
  EXPECT_EQ(outcome.out, "line,id,reason\n5,8,UNKNOWN_ID\n");
  EXPECT_EQ(position_of("1"), "[4.0,0.0,0.0]");
  EXPECT_EQ(json_of({"scene", "describe", "world"})["revision"], 2);
}

TEST_F(BulkUpdateTest, NoRowOfOneRevisionIsAppliedIfOneIsMalformed) {
  const TestFile file("id,at.x,at.y,at.z\n1,0,0,0\n2,0,0,0\n3,zero,0,0\n", "rows.csv");
  const BulkOutcome outcome =
      run({"insert", "world", "point", "--from-csv", file.path(), "--batch", "1", "--one-revision"});
  EXPECT_EQ(outcome.code, ExitCode::kFailed);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr(absl::StrCat(file.path(), ":4: ")), HasSubstr("nothing was applied")));
  EXPECT_EQ(json_of({"scene", "describe", "world"})["objects"], 0);
}

TEST_F(BulkUpdateTest, ARevisionOfTooManyRowsIsRefusedByName) {
  std::string rows = "id,at.x,at.y,at.z\n";
  for (int i = 1; i <= (1 << 20) + 1; ++i) absl::StrAppend(&rows, i, ",0,0,0\n");
  const TestFile file(rows, "rows.csv");
  const BulkOutcome outcome =
      run({"insert", "world", "point", "--from-csv", file.path(), "--batch", "65536", "--one-revision"});
  EXPECT_EQ(outcome.code, ExitCode::kFailed);
  EXPECT_THAT(outcome.err, HasSubstr("has more than 1048576 rows, the most that one revision can have"));
  EXPECT_EQ(json_of({"scene", "describe", "world"})["objects"], 0);
}

TEST_F(BulkUpdateTest, ObjectsWithALeaseGoWhenTheInputHasEnded) {
  NamedPipe pipe;
  std::ostringstream out;
  std::ostringstream err;
  std::thread command([&] {
    EXPECT_EQ(run_into({"insert", "world", "point", "--from-ndjson", pipe.path(), "--lease", "0.2"}, out, err),
              ExitCode::kOk)
        << err.str();
  });
  pipe.write("{\"id\":1,\"at\":[1,2,3]}\n");
  const auto wait_for_objects = [&](int count) {
    for (int i = 0; i < 3000 && json_of({"scene", "describe", "world"})["objects"] != count; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_EQ(json_of({"scene", "describe", "world"})["objects"], count);
  };
  wait_for_objects(1);
  pipe.close();
  command.join();
  wait_for_objects(0);
}

TEST_F(BulkUpdateTest, OptionsThatExcludeEachOtherAreUsageErrors) {
  const TestFile file("id,to.x,to.y,to.z\n");
  const std::string& path = file.path();
  for (const std::vector<std::string>& line : std::vector<std::vector<std::string>>{
           {"move", "world", "--from-csv", path, "--id", "1"},
           {"move", "world", "--from-csv", path, "--rotation", "0,0,0,1", "--rotation", "0,0,0,1"},
           {"move", "world", "--id", "1"},
           {"move", "world", "--id", "1", "--to", "0,0,0", "--batch", "9"},
           {"insert", "world", "ball", "--from-csv", path, "--at", "0,0,0"},
           {"insert", "world", "mixed", "--id", "1", "--at", "0,0,0"},
           {"insert", "world", "point", "--id", "1", "--at", "0,0,0", "--one-revision"},
           {"insert", "world", "point", "--id", "1", "--at", "0,0,0", "--lease", "5"},
           {"insert", "world", "point", "--from-csv", path, "--lease", "0"},
           {"insert", "world", "ball", "--radius", "1"},
           {"remove", "world", "--from-csv", path, "--all"},
           {"remove", "world", "--from-csv", path, "--from-ndjson", path}}) {
    const BulkOutcome outcome = run(line);
    EXPECT_EQ(outcome.code, ExitCode::kUsage) << ::testing::PrintToString(line) << outcome.err;
  }
}

}  // namespace
}  // namespace locus::cli
