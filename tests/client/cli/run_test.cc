#include "client/cli/run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <sstream>

#include "tests/client/lib/fake_server.h"

namespace locus::cli {
namespace {

using client::testing::FakeServer;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Outcome {
  ExitCode code;
  std::string out;
  std::string err;
};

Outcome run(const std::vector<std::string>& arguments) {
  std::ostringstream out;
  std::ostringstream err;
  Context context(out, err, Progress::kSilent);
  const ExitCode code = run_line(arguments, context);
  return {code, out.str(), err.str()};
}

class RunTest : public ::testing::Test {
 protected:
  Outcome run_here(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--address", server_.address()});
    return run(arguments);
  }
  Json json_of(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"-o", "json"});
    const Outcome outcome = run_here(arguments);
    EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
    return Json::parse(outcome.out, nullptr, /*allow_exceptions=*/false);
  }

  FakeServer server_;
};

TEST(HelpTest, EveryCommandHasHelpWithExamples) {
  const std::vector<std::vector<std::string>> commands = {{},
                                                          {"scene"},
                                                          {"scene", "create"},
                                                          {"scene", "list"},
                                                          {"scene", "describe"},
                                                          {"scene", "delete"},
                                                          {"instance"},
                                                          {"instance", "place"},
                                                          {"instance", "list"},
                                                          {"instance", "remove"},
                                                          {"import"},
                                                          {"generate"},
                                                          {"generate", "city"},
                                                          {"generate", "terrain"},
                                                          {"generate", "blob"},
                                                          {"mesh"},
                                                          {"mesh", "list"},
                                                          {"mesh", "show"},
                                                          {"mesh", "download"},
                                                          {"mesh", "delete"},
                                                          {"top"},
                                                          {"config"},
                                                          {"config", "show"},
                                                          {"dump"},
                                                          {"export"},
                                                          {"backup"},
                                                          {"restore"},
                                                          {"insert"},
                                                          {"move"},
                                                          {"remove"},
                                                          {"query"},
                                                          {"get"},
                                                          {"query", "ray"},
                                                          {"query", "ball"},
                                                          {"query", "box"},
                                                          {"query", "nearest"},
                                                          {"render"},
                                                          {"run"},
                                                          {"wait"},
                                                          {"cluster"},
                                                          {"cluster", "status"},
                                                          {"cluster", "move"},
                                                          {"cluster", "drain"},
                                                          {"cluster", "rebalance"},
                                                          {"cluster", "map"},
                                                          {"limits"},
                                                          {"health"},
                                                          {"context"},
                                                          {"context", "list"},
                                                          {"context", "show"},
                                                          {"context", "use"},
                                                          {"context", "set"},
                                                          {"context", "remove"},
                                                          {"token"},
                                                          {"token", "create"},
                                                          {"token", "list"},
                                                          {"token", "revoke"},
                                                          {"cert"},
                                                          {"cert", "authority"},
                                                          {"cert", "server"},
                                                          {"cert", "client"},
                                                          {"version"}};
  for (std::vector<std::string> command : commands) {
    command.push_back("--help");
    const Outcome outcome = run(command);
    EXPECT_EQ(outcome.code, ExitCode::kOk) << command.front();
    EXPECT_THAT(outcome.out, HasSubstr("Examples:\n  locus ")) << command.front();
    EXPECT_THAT(outcome.err, IsEmpty());
  }
}

TEST(UsageTest, MistakesInTheLineAreUsageErrors) {
  for (const std::vector<std::string>& line : std::vector<std::vector<std::string>>{
           {},
           {"no-such-command"},
           {"query", "ray", "arena", "--from", "0,0", "--dir", "0,0,1"},
           {"query", "ray", "arena", "--from", "0,0,0"},
           {"query", "ray", "arena", "--from", "0,0,0", "--dir", "0,0,1", "--mode", "some"},
           {"query", "ray", "arena", "--from", "0,0,0", "--dir", "0,0,1", "--at-least", "1", "--exactly", "2"},
           {"query", "nearest", "arena", "--k", "3"},
           {"query", "nearest", "arena", "--at", "0,0,0", "--k", "-1"},
           {"query", "ball", "arena", "--at", "0,0,0", "--radius", "1", "--as-of", "12+"},
           {"query", "ball", "arena", "--at", "0,0,0", "--radius", "1", "--as-of", "-1"},
           {"query", "ball", "arena", "--at", "0,0,0", "--radius", "1", "--as-of", "12", "--outside", "guess"},
           {"insert", "arena", "cone", "--id", "1", "--at", "0,0,0"},
           {"insert", "arena", "ball", "--id", "1", "--at", "0,0,0"},
           {"insert", "arena", "point", "--id", "1", "--at", "0,0,0", "--radius", "1"},
           {"insert", "arena", "point", "--id", "-1", "--at", "0,0,0"},
           {"remove", "arena"},
           {"get", "arena"},
           {"scene", "create", "arena", "--label", "nonsense"},
           {"generate", "city"},
           {"-o", "xml", "limits"}}) {
    const Outcome outcome = run(line);
    EXPECT_EQ(outcome.code, ExitCode::kUsage) << ::testing::PrintToString(line) << outcome.err;
    EXPECT_THAT(outcome.err, ::testing::Not(IsEmpty()));
  }
}

TEST(UsageTest, AVectorHasThreeNumbers) {
  for (const std::vector<std::string>& line :
       std::vector<std::vector<std::string>>{{"insert", "arena", "box", "--id", "1", "--at", "0,0,0", "--half", "2"},
                                             {"insert", "arena", "ball", "--id", "1", "--at", "2", "--radius", "1"},
                                             {"move", "arena", "--id", "1", "--to", "2"},
                                             {"query", "ray", "arena", "--from", "2", "--dir", "0,0,1"},
                                             {"query", "ray", "arena", "--from", "2", "0", "0", "--dir", "0,0,1"},
                                             {"render", "arena", "--up", "2", "x.png"},
                                             {"import", "level.obj", "--scene", "arena", "--at", "2"}}) {
    const Outcome outcome = run(line);
    EXPECT_EQ(outcome.code, ExitCode::kUsage) << ::testing::PrintToString(line);
    EXPECT_THAT(outcome.err, HasSubstr("'2' is not X,Y,Z: three numbers with commas")) << outcome.err;
  }
  EXPECT_THAT(run({"move", "arena", "--id", "1", "--to", "0,0,0", "--rotation", "1"}).err,
              HasSubstr("'1' is not X,Y,Z,W: four numbers"));
}

TEST(UsageTest, VersionNeedsNoServer) {
  EXPECT_EQ(run({"version"}).code, ExitCode::kOk);
  EXPECT_THAT(run({"--version"}).out, HasSubstr(LOCUS_VERSION));
}

TEST(UsageTest, WithoutAServerTheErrorSaysHowToStartOne) {
  const Outcome outcome = run({"-a", "unix:/nonexistent/locus.sock", "health"});
  EXPECT_EQ(outcome.code, ExitCode::kUnreachable);
  EXPECT_EQ(outcome.err,
            "error: nothing answers at unix:/nonexistent/locus.sock: start one with `locusd`, or give --address\n");
}

TEST_F(RunTest, ScenesAreCreatedListedDescribedAndDeleted) {
  const Json created = json_of({"scene", "create", "arena", "--label", "map=delta", "--winding", "cw"});
  EXPECT_EQ(created["name"], "arena");
  EXPECT_EQ(created["epoch"], "9223372036854775808");
  EXPECT_EQ(created["winding"], "clockwise");
  EXPECT_EQ(created["labels"]["map"], "delta");
  EXPECT_EQ(json_of({"scene", "list"})["scenes"][0]["name"], "arena");
  EXPECT_EQ(json_of({"scene", "describe", "arena"})["state"], "ready");
  EXPECT_EQ(json_of({"scene", "delete", "arena"})["deleted"], "arena");
  EXPECT_EQ(json_of({"scene", "delete", "arena", "--if-present"}), Json({{"absent", "arena"}}));
  const Outcome gone = run_here({"scene", "describe", "arena"});
  EXPECT_EQ(gone.code, ExitCode::kNotFound);
  EXPECT_THAT(gone.err, HasSubstr("hint: `locus scene list`"));
}

TEST_F(RunTest, ADeniedCallExitsFour) {
  server_.scenes.denied = true;
  EXPECT_EQ(run_here({"scene", "delete", "arena"}).code, ExitCode::kDenied);
}

TEST_F(RunTest, InsertSendsColumnsInDoubleWithLabels) {
  const Json answer =
      json_of({"insert",  "arena",    "ball", "--id",    "7", "--at",  "-1,2,3", "--id",     "8",   "--at",
               "0.1,0,0", "--radius", "0.5",  "--group", "3", "--tag", "42",     "--layers", "0x6", "--upsert"});
  EXPECT_EQ(answer["applied"], 1);
  EXPECT_EQ(answer["revision"], 1);
  const v1::UpdateBatch& batch = server_.updates.last_batch;
  ASSERT_EQ(batch.inserts_size(), 1);
  EXPECT_THAT(batch.inserts(0).ids(), ElementsAre(7, 8));
  EXPECT_THAT(batch.inserts(0).positions_f64(), ElementsAre(-1, 2, 3, 0.1, 0, 0));
  EXPECT_THAT(batch.inserts(0).ball().radii(), ElementsAre(0.5f));
  EXPECT_THAT(batch.inserts(0).groups(), ElementsAre(3));
  EXPECT_THAT(batch.inserts(0).tags(), ElementsAre(42));
  EXPECT_THAT(batch.inserts(0).layers(), ElementsAre(6));
  EXPECT_TRUE(batch.upsert());
}

TEST_F(RunTest, EveryShapeIsSentInItsOwnColumns) {
  ASSERT_EQ(run_here({"insert", "arena", "point", "--id", "1", "--at", "0,0,0"}).code, ExitCode::kOk);
  EXPECT_TRUE(server_.updates.last_batch.inserts(0).has_point());
  ASSERT_EQ(run_here({"insert", "arena", "box", "--id", "1", "--at", "0,0,0", "--half", "1,2,3"}).code, ExitCode::kOk);
  EXPECT_THAT(server_.updates.last_batch.inserts(0).box().half_extents(), ElementsAre(1, 2, 3));
  ASSERT_EQ(run_here({"insert", "arena", "capsule", "--id", "1", "--at", "0,0,0", "--axis", "0,1,0", "--radius", "2",
                      "--rotation", "0,0,0,1", "--tick", "5"})
                .code,
            ExitCode::kOk);
  EXPECT_THAT(server_.updates.last_batch.inserts(0).capsule().half_axes(), ElementsAre(0, 1, 0));
  EXPECT_EQ(server_.updates.last_batch.tick(), 5u);
}

TEST_F(RunTest, CompoundsAreSentWithTheirPartsAndPoses) {
  const std::string parts = R"([{"ball":0.5,"at":[0,0,2],"layers":2},{"box":[1,2,3],"at":[0,0,1]}])";
  ASSERT_EQ(run_here({"insert", "arena", "compound", "--id", "1", "--at", "0,0,0", "--id", "2", "--at", "9,0,0",
                      "--parts", parts, "--expire-ticks", "30"})
                .code,
            ExitCode::kOk);
  const v1::Insert& insert = server_.updates.last_batch.inserts(0);
  EXPECT_THAT(insert.ids(), ElementsAre(1, 2));
  ASSERT_EQ(insert.compound().parts_size(), 2);
  EXPECT_THAT(insert.compound().parts(0).layers(), ElementsAre(2));
  EXPECT_THAT(insert.expire_ticks(), ElementsAre(30));
  EXPECT_EQ(insert.layers_size(), 0);
  ASSERT_EQ(
      run_here({"move", "arena", "--id", "1", "--to", "1,0,0", "--parts", R"([{"at":[0,0,3]},{"at":[0,0,1]}])"}).code,
      ExitCode::kOk);
  EXPECT_EQ(server_.updates.last_batch.moves(0).parts_each(), 2u);
  EXPECT_THAT(server_.updates.last_batch.moves(0).part_positions(), ElementsAre(0, 0, 3, 0, 0, 1));
  EXPECT_EQ(run_here({"insert", "arena", "compound", "--id", "1", "--at", "0,0,0"}).code, ExitCode::kUsage);
  EXPECT_EQ(run_here({"insert", "arena", "ball", "--id", "1", "--at", "0,0,0", "--radius", "1", "--parts", parts}).code,
            ExitCode::kUsage);
  EXPECT_THAT(run_here({"insert", "arena", "compound", "--id", "1", "--at", "0,0,0", "--parts", "[{}]"}).err,
              HasSubstr("part 0: needs one of ball, box and capsule"));
}

TEST_F(RunTest, ScenesAreCreatedWithLifetimes) {
  const Json made = json_of({"scene", "create", "match", "--idle-ttl-s", "600", "--mesh-grace-s", "60"});
  EXPECT_EQ(made["idle_ttl_s"], 600);
  EXPECT_EQ(made["mesh_grace_s"], 60);
  EXPECT_EQ(server_.scenes.scenes["match"].spec().idle_ttl_s(), 600u);
  EXPECT_FALSE(json_of({"scene", "create", "other"}).contains("idle_ttl_s"));
}

TEST_F(RunTest, RowsOfCompoundsCarryTheirOwnParts) {
  const std::string path = ::testing::TempDir() + "/compounds.ndjson";
  std::ofstream(path)
      << R"({"id":1,"shape":"compound","at":[0,0,0],"parts":[{"ball":1,"at":[0,0,1]}]})"
      << "\n"
      << R"({"id":2,"shape":"compound","at":[1,0,0],"parts":[{"ball":1,"at":[0,0,1]}],"layers":4})"
      << "\n"
      << R"({"id":3,"shape":"compound","at":[2,0,0],"expire_ticks":7,"layers":4,)"
      << R"("parts":[{"capsule":{"axis":[0,0,1],"radius":2},"at":[0,0,1e0],"layers":8},{"box":[1,1,1],"at":[0,-1,0]}]})"
      << "\n";
  ASSERT_EQ(run_here({"insert", "arena", "mixed", "--from-ndjson", path}).code, ExitCode::kOk);
  const v1::UpdateBatch inserted = server_.updates.last_batch;
  ASSERT_EQ(inserted.inserts_size(), 3);
  EXPECT_EQ(inserted.inserts(0).layers_size(), 0);
  EXPECT_THAT(inserted.inserts(1).layers(), ElementsAre(4));
  EXPECT_THAT(inserted.inserts(2).expire_ticks(), ElementsAre(7));
  ASSERT_EQ(inserted.inserts(2).compound().parts_size(), 2);
  EXPECT_THAT(inserted.inserts(2).compound().parts(0).capsule().radii(), ElementsAre(2));
  EXPECT_THAT(inserted.inserts(2).compound().parts(1).positions(), ElementsAre(0, -1, 0));
  std::ofstream(path) << R"({"id":1,"to":[0,0,0],"parts":[{"at":[0,0,2]}]})"
                      << "\n"
                      << R"({"id":2,"to":[0,0,0]})"
                      << "\n";
  ASSERT_EQ(run_here({"move", "arena", "--from-ndjson", path}).code, ExitCode::kOk);
  ASSERT_EQ(server_.updates.last_batch.moves_size(), 2);
  EXPECT_THAT(server_.updates.last_batch.moves(0).part_positions(), ElementsAre(0, 0, 2));
  EXPECT_EQ(server_.updates.last_batch.moves(1).parts_each(), 0u);
  std::ofstream(path) << R"({"id":1,"shape":"compound","at":[0,0,0],"parts":[{"cone":1}]})"
                      << "\n";
  EXPECT_THAT(run_here({"insert", "arena", "mixed", "--from-ndjson", path}).err,
              HasSubstr("compounds.ndjson:1: parts: part 0: unknown key 'cone'"));
}

TEST_F(RunTest, MovesAndRemovesReachTheServer) {
  ASSERT_EQ(run_here({"move", "arena", "--id", "7", "--to", "1,2,4", "--teleport"}).code, ExitCode::kOk);
  EXPECT_THAT(server_.updates.last_batch.moves(0).positions_f64(), ElementsAre(1, 2, 4));
  EXPECT_TRUE(server_.updates.last_batch.moves(0).teleport());
  ASSERT_EQ(run_here({"remove", "arena", "--id", "7", "--group", "3"}).code, ExitCode::kOk);
  EXPECT_THAT(server_.updates.last_batch.remove_ids(), ElementsAre(7));
  EXPECT_THAT(server_.updates.last_batch.remove_groups(), ElementsAre(3));
  ASSERT_EQ(run_here({"remove", "arena", "--all"}).code, ExitCode::kOk);
  EXPECT_TRUE(server_.updates.last_batch.clear());
}

TEST_F(RunTest, ARefusedItemIsShownAndExitsNotFoundForAnUnknownId) {
  v1::ItemError error;
  error.set_field("moves[0].ids");
  error.set_id(8);
  error.set_reason(v1::REASON_UNKNOWN_ID);
  server_.updates.item_errors = {error};
  const Outcome outcome = run_here({"-o", "json", "move", "arena", "--id", "8", "--to", "0,0,0"});
  EXPECT_EQ(outcome.code, ExitCode::kNotFound);
  EXPECT_EQ(Json::parse(outcome.out)["errors"][0]["reason"], "UNKNOWN_ID");
  EXPECT_EQ(Json::parse(outcome.err)["error"]["reason"], "UNKNOWN_ID");
}

TEST_F(RunTest, FirstHitsShowHitsAndMisses) {
  server_.queries.answer = [](const v1::QueryRequest&, v1::QueryResult& result) {
    result.set_epoch(5);
    result.set_revision(12);
    v1::BlockResult& block = *result.add_blocks();
    for (const float t : {2.5f, std::numeric_limits<float>::infinity()}) block.add_t(t);
    for (const uint64_t id : {uint64_t{1} << 63, uint64_t{0}}) block.add_ids(id);
    for (const uint32_t triangle : {3u, 0xFFFFFFFFu}) block.add_triangles(triangle);
    for (const float part : {0.1f, 0.f, 0.f, 0.f, 0.f, 0.f}) block.add_points(part);
    for (const float part : {0.f, 1.f, 0.f, 0.f, 0.f, 0.f}) block.add_normals(part);
    return grpc::Status::OK;
  };
  const std::vector<std::string> line = {"query", "ray",    "arena",  "--from",         "0,1,0", "--from",
                                         "5,1,0", "--dir",  "0,0,-1", "--t-max",        "100",   "--mask",
                                         "6",     "--cull", "back",   "--ignore-group", "3"};
  const Json answer = json_of(line);
  EXPECT_EQ(answer["epoch"], "5");
  EXPECT_EQ(answer["revision"], 12);
  EXPECT_EQ(answer["hits"][0], Json::parse(R"({"ray": 0, "hit": true, "t": 2.5, "id": "9223372036854775808",
      "triangle": 3, "point": [0.1, 0.0, 0.0], "normal": [0.0, 1.0, 0.0]})"));
  EXPECT_EQ(answer["hits"][1]["hit"], false);
  EXPECT_TRUE(answer["hits"][1]["t"].is_null());
  EXPECT_TRUE(answer["hits"][1]["triangle"].is_null());
  const v1::QueryBlock& block = server_.queries.last_batch.blocks(0);
  EXPECT_THAT(block.rays().origins(), ElementsAre(0, 1, 0, 5, 1, 0));
  EXPECT_THAT(block.rays().directions(), ElementsAre(0, 0, -1));
  EXPECT_THAT(block.rays().t_max(), ElementsAre(100));
  EXPECT_EQ(block.rays().cull(), v1::CULL_BACK);
  EXPECT_THAT(block.masks(), ElementsAre(6));
  EXPECT_THAT(block.ignore_groups(), ElementsAre(3));
  EXPECT_EQ(server_.queries.scene, "arena");
}

TEST_F(RunTest, QueriesTakeGroupsTagsAndIdsToFilterBy) {
  server_.queries.answer = [](const v1::QueryRequest&, v1::QueryResult& result) {
    result.add_blocks();
    return grpc::Status::OK;
  };
  run_here({"query", "ball", "arena", "--at", "0,1,0", "--radius", "5", "--only-group", "3", "--only-group", "4",
            "--tag", "7", "--tag-mask", "15", "--self-id", "9"});
  const v1::QueryBlock block = server_.queries.last_batch.blocks(0);
  EXPECT_THAT(block.only_groups(), ElementsAre(3, 4));
  EXPECT_EQ(block.only_groups_each(), 2u);
  EXPECT_THAT(block.tags(), ElementsAre(7));
  EXPECT_THAT(block.tag_masks(), ElementsAre(15));
  EXPECT_THAT(block.self_ids(), ElementsAre(9));
  EXPECT_THAT(run({"query", "ball", "arena", "--at", "0,1,0", "--radius", "5", "--tag-mask", "15"}).err,
              HasSubstr("--tag-mask needs --tag"));
}

TEST_F(RunTest, ARotationTurnsTheDirectionsOfOneOrigin) {
  server_.queries.answer = [](const v1::QueryRequest&, v1::QueryResult& result) {
    result.add_blocks();
    return grpc::Status::OK;
  };
  run_here(
      {"query", "ray", "arena", "--from", "0,1,0", "--dir", "1,0,0", "--dir", "0,1,0", "--rotation", "0,0.6,0,0.8"});
  const v1::QueryBlock block = server_.queries.last_batch.blocks(0);
  EXPECT_THAT(block.rays().origins(), ElementsAre(0, 1, 0));
  EXPECT_THAT(block.rays().directions(), ElementsAre(1, 0, 0, 0, 1, 0));
  EXPECT_THAT(block.rotation(), ElementsAre(0, 0.6f, 0, 0.8f));
}

TEST_F(RunTest, TheFormerNameOfTMaxIsAcceptedAndHidden) {
  server_.queries.answer = [](const v1::QueryRequest&, v1::QueryResult& result) {
    result.add_blocks();
    return grpc::Status::OK;
  };
  run_here({"query", "ray", "arena", "--from", "0,1,0", "--dir", "0,0,-1", "--max-t", "7"});
  EXPECT_THAT(server_.queries.last_batch.blocks(0).rays().t_max(), ElementsAre(7));
  EXPECT_THAT(run({"query", "ray", "--help"}).out, HasSubstr("--t-max"));
  EXPECT_THAT(run({"query", "ray", "--help"}).out, ::testing::Not(HasSubstr("--max-t")));
}

TEST_F(RunTest, ModeAnyWritesYesOrNoForEachRay) {
  server_.queries.answer = [](const v1::QueryRequest&, v1::QueryResult& result) {
    result.add_blocks()->set_hits(std::string("\1\0", 2));
    return grpc::Status::OK;
  };
  const Json answer =
      json_of({"query", "ray", "arena", "--from", "0,0,0", "--from", "1,1,1", "--dir", "0,0,1", "--mode", "any"});
  EXPECT_EQ(answer["rays"].dump(), R"([{"ray":0,"hit":true},{"ray":1,"hit":false}])");
  EXPECT_THAT(server_.queries.last_batch.blocks(0).columns(), IsEmpty());
}

TEST_F(RunTest, OverlapsAreRowsByQueryAndTruncatedQueriesAreListed) {
  server_.queries.answer = [](const v1::QueryRequest&, v1::QueryResult& result) {
    v1::BlockResult& block = *result.add_blocks();
    for (const uint32_t count : {2, 0}) block.add_counts(count);
    for (const uint64_t id : {4, 9}) block.add_ids(id);
    for (const uint64_t tag : {1, 2}) block.add_tags(tag);
    block.add_truncated(0);
    return grpc::Status::OK;
  };
  const Json ball = json_of({"query", "ball", "arena", "--at", "0,0,0", "--at", "1,1,1", "--radius", "2", "--columns",
                             "tag", "--source", "dynamic", "--after-id", "3"});
  EXPECT_EQ(ball["found"].dump(), R"([{"ball":0,"id":"4","tag":"1"},{"ball":0,"id":"9","tag":"2"}])");
  EXPECT_EQ(ball["truncated"].dump(), "[0]");
  EXPECT_EQ(server_.queries.last_batch.blocks(0).source(), v1::SOURCE_DYNAMIC);
  EXPECT_EQ(server_.queries.last_batch.blocks(0).after_id(), 3u);
  const Json box = json_of(
      {"query", "box", "arena", "--at", "0,0,0", "--half", "1,2,3", "--rotation", "0,0,1,0", "--detail", "triangles"});
  EXPECT_EQ(box["found"][0]["box"], 0);
  EXPECT_TRUE(box["found"][0]["triangle"].is_null()) << "the fake sent no triangles";
  EXPECT_THAT(server_.queries.last_batch.blocks(0).boxes().rotations(), ElementsAre(0, 0, 1, 0));
}

TEST_F(RunTest, NearestAreRowsByDistanceWithTheirPoints) {
  server_.queries.answer = [](const v1::QueryRequest&, v1::QueryResult& result) {
    v1::BlockResult& block = *result.add_blocks();
    for (const uint32_t count : {1, 0}) block.add_counts(count);
    block.add_t(0.5f);
    block.add_ids(4);
    block.add_triangles(17);
    for (const float x : {1.f, 2.f, 3.f}) block.add_points(x);
    return grpc::Status::OK;
  };
  const Json answer = json_of({"query", "nearest", "arena", "--at", "0,0,0", "--at", "1,1,1", "--k", "2",
                               "--max-distance", "9", "--detail", "triangles"});
  EXPECT_EQ(answer["found"].dump(), R"([{"query":0,"t":0.5,"id":"4","triangle":17,"point":[1.0,2.0,3.0]}])");
  const v1::QueryBlock& block = server_.queries.last_batch.blocks(0);
  EXPECT_THAT(block.nearest().points(), ElementsAre(0, 0, 0, 1, 1, 1));
  EXPECT_THAT(block.nearest().max_distances(), ElementsAre(9));
  EXPECT_EQ(block.nearest().k(), 2u);
  EXPECT_EQ(block.nearest().detail(), v1::STATIC_DETAIL_TRIANGLES);
  EXPECT_THAT(block.columns(), ElementsAre(v1::COLUMN_T, v1::COLUMN_ID, v1::COLUMN_TRIANGLE, v1::COLUMN_POINT));
}

TEST_F(RunTest, AsOfIsSentPerQueryAndTheEffectiveTimesAreShown) {
  server_.queries.answer = [](const v1::QueryRequest&, v1::QueryResult& result) {
    v1::BlockResult& block = *result.add_blocks();
    for (int i = 0; i < 2; ++i) block.add_counts(0);
    for (const uint64_t tick : {12, 14}) block.add_resolved_ticks(tick);
    for (const float fraction : {0.5f, 0.0f}) block.add_resolved_fractions(fraction);
    block.add_clamped(1);
    return grpc::Status::OK;
  };
  const Json answer = json_of({"query", "ball", "arena", "--at", "0,0,0", "--at", "1,1,1", "--radius", "2", "--as-of",
                               "12+0.5", "--as-of", "99", "--outside", "clamp"});
  EXPECT_EQ(answer["as_of"].dump(), R"(["12+0.5","14"])");
  EXPECT_EQ(answer["clamped"].dump(), "[1]");
  const v1::QueryBlock& block = server_.queries.last_batch.blocks(0);
  EXPECT_THAT(block.as_of_ticks(), ElementsAre(12, 99));
  EXPECT_THAT(block.as_of_fractions(), ElementsAre(0.5f, 0));
  EXPECT_EQ(block.outside_history(), v1::OUTSIDE_HISTORY_CLAMP);
}

TEST_F(RunTest, PositionsThatAreNotFloatsAreSentInAFrame) {
  server_.queries.answer = [](const v1::QueryRequest&, v1::QueryResult& result) {
    v1::BlockResult& block = *result.add_blocks();
    block.add_counts(0);
    return grpc::Status::OK;
  };
  json_of({"query", "ball", "arena", "--at", "1000000.1,0,0", "--at", "1000001.1,0,0", "--radius", "1"});
  const v1::QueryBlock& block = server_.queries.last_batch.blocks(0);
  EXPECT_EQ(block.frame().x(), 1000000.1);
  EXPECT_THAT(block.balls().centers(), ElementsAre(0, 0, 0, 1, 0, 0));
}

TEST_F(RunTest, APositionThatIsNotFiniteIsNotMovedIntoTheFrame) {
  run_here({"query", "ball", "arena", "--at", "nan,0,0", "--radius", "1"});
  EXPECT_EQ(server_.queries.last_batch.blocks(0).frame().x(), 0);
  EXPECT_TRUE(std::isnan(server_.queries.last_batch.blocks(0).balls().centers(0)));
}

TEST_F(RunTest, GetShowsTheFoundIdsAndNamesTheMissingOnes) {
  server_.queries.answer = [](const v1::QueryRequest&, v1::QueryResult& result) {
    v1::BlockResult& block = *result.add_blocks();
    for (const uint64_t id : {7, 0}) block.add_ids(id);
    for (const double part : {0.1, 2.0, 3.0, 0.0, 0.0, 0.0}) block.add_positions(part);
    for (const float part : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 0.f}) block.add_rotations(part);
    return grpc::Status::OK;
  };
  const Outcome outcome = run_here({"-o", "json", "get", "arena", "--id", "7", "--id", "8"});
  EXPECT_EQ(outcome.code, ExitCode::kNotFound);
  const Json answer = Json::parse(outcome.out);
  ASSERT_EQ(answer["things"].size(), 1u);
  EXPECT_EQ(answer["things"][0]["id"], "7");
  EXPECT_EQ(answer["things"][0]["position"].dump(), "[0.1,2.0,3.0]");
  EXPECT_EQ(answer["missing"].dump(), R"(["8"])");
}

TEST_F(RunTest, LimitsHealthAndVersionDescribeTheServer) {
  EXPECT_EQ(json_of({"limits"})["limits"].dump(), R"([{"name":"max_scenes","value":1024,"used":2,"refused":3}])");
  EXPECT_EQ(json_of({"health"})["status"], "SERVING");
  EXPECT_EQ(json_of({"version", "--server"})["server_version"], "1.2.3");
}

TEST_F(RunTest, AGeneratedCityIsUploadedAndPlaced) {
  const Json answer = json_of({"generate", "city", "--triangles", "500", "--seed", "3", "--scene", "arena", "--create",
                               "--at", "10,0,0", "--mesh", "town"});
  EXPECT_EQ(answer["meshes"][0]["mesh"], "town");
  EXPECT_EQ(answer["meshes"][0]["id"], "9223372036854775808");
  EXPECT_EQ(answer["scene"], "arena");
  EXPECT_EQ(server_.scenes.scenes.count("arena"), 1u);
  const v1::Placement& placed = server_.scenes.last_change.place(0);
  EXPECT_EQ(placed.mesh(), "town");
  EXPECT_THAT(placed.translations(), ElementsAre(10, 0, 0));
  EXPECT_EQ(json_of({"generate", "city", "--triangles", "500", "--seed", "3", "--scene", "arena", "--mesh",
                     "town"})["meshes"][0]["already_known"],
            true)
      << "the same seed gives the same bytes";
}

TEST_F(RunTest, AGeneratedCityWrittenToAFileCanBeImported) {
  const std::string path = ::testing::TempDir() + "locus_run_test_city.obj";
  ASSERT_EQ(run({"generate", "city", "--triangles", "100", "--out", path}).code, ExitCode::kOk);
  const Json answer = json_of({"import", path, "--scene", "arena", "--id", "5", "--create"});
  std::remove(path.c_str());
  ASSERT_EQ(answer["meshes"].size(), 1u);
  EXPECT_GE(answer["meshes"][0]["triangles"], 12);
  EXPECT_EQ(answer["format"], "OBJ");
  EXPECT_THAT(server_.scenes.last_change.place(0).ids(), ElementsAre(5));
}

TEST_F(RunTest, EveryCommandAnswersInCsv) {
  const auto csv = [this](std::vector<std::string> line) {
    line.insert(line.begin(), {"-o", "csv"});
    const Outcome outcome = run_here(line);
    EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
    return outcome.out;
  };
  EXPECT_EQ(csv({"scene", "list"}),
            "name,state,revision,tick,objects,instances,triangles,memory_bytes,mesh_bytes,past_bytes\n");
  EXPECT_THAT(csv({"scene", "create", "arena"}), HasSubstr("\narena,ready,0,0,0,0,0,0,0,0,9223372036854775808,"));
  EXPECT_THAT(csv({"scene", "describe", "arena"}), HasSubstr(",min.x,min.y,min.z,max.x,"));
  EXPECT_EQ(csv({"insert", "arena", "point", "--id", "1", "--at", "0,0,0"}),
            "applied,refused,revision,tick,epoch\n1,0,1,0,9\n");
  EXPECT_EQ(csv({"limits"}), "name,value,used,refused\nmax_scenes,1024,2,3\n");
  EXPECT_THAT(csv({"health"}), HasSubstr("address,status\n"));
  EXPECT_THAT(csv({"version", "--server"}), HasSubstr("\"[\"\"rays\"\"]\""));
  EXPECT_THAT(csv({"generate", "city", "--triangles", "100", "--scene", "arena"}), HasSubstr("mesh,triangles,"));
  server_.queries.answer = [](const v1::QueryRequest&, v1::QueryResult& result) {
    result.add_blocks()->add_counts(0);
    return grpc::Status::OK;
  };
  EXPECT_EQ(csv({"query", "ball", "arena", "--at", "0,0,0", "--radius", "1", "--columns", "pose"}),
            "ball,id,position.x,position.y,position.z,rotation.x,rotation.y,rotation.z,rotation.w\n");
  EXPECT_EQ(csv({"scene", "delete", "arena"}), "deleted\narena\n");
}

TEST_F(RunTest, ErrorsOfCsvOutputAreTextLines) {
  const Outcome outcome = run_here({"-o", "csv", "scene", "describe", "nowhere"});
  EXPECT_THAT(outcome.err, ::testing::StartsWith("error: "));
  EXPECT_EQ(outcome.out, "");
}

TEST_F(RunTest, AMissingFileIsNotFound) {
  EXPECT_EQ(run_here({"import", "/nonexistent/level.obj", "--scene", "arena"}).code, ExitCode::kNotFound);
}

}  // namespace
}  // namespace locus::cli
