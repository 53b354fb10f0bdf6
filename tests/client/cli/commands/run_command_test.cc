// Tests that run scripts against a real locusd: the committed examples, copies of the examples with mistakes, and the
// module `locus`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "client/cli/run.h"
#include "tests/support/daemon_process.h"

namespace locus::cli {
namespace {

using test::DaemonProcess;
using test::TemporaryFolder;
using test::text_of;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

const std::string kExamples = std::string(LOCUS_SOURCE_DIR) + "/client/cli/script/examples/";

struct Outcome {
  ExitCode code;
  std::string out;
  std::string err;
};

class RunCommandTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder();
    daemon_ =
        new DaemonProcess({"--listen", "127.0.0.1:0", "--port-file", folder_->file("port")}, folder_->file("log"));
    address_ = absl::StrCat("127.0.0.1:", DaemonProcess::wait_for_port(folder_->file("port")));
  }
  static void TearDownTestSuite() {
    daemon_->signal(SIGTERM);
    EXPECT_EQ(daemon_->wait(), 0) << "no script harms the server";
    delete daemon_;
    delete folder_;
  }

  static Outcome run(std::vector<std::string> arguments, const std::string& address = address_) {
    std::ostringstream out;
    std::ostringstream err;
    Context context(out, err, Progress::kSilent);
    arguments.insert(arguments.begin(), {"--address", address});
    const ExitCode code = run_line(arguments, context);
    return {code, out.str(), err.str()};
  }
  // Writes a script to a file that is removed with the suite, and returns its path.
  static std::string file_with(const std::string& text, const std::string& ending = ".lua") {
    const std::string file = folder_->file("script" + ending);
    std::ofstream(file) << text;
    return file;
  }
  static Outcome run_lua(const std::string& text, std::vector<std::string> options = {}) {
    options.insert(options.begin(), {"run", file_with(text)});
    return run(options);
  }

  static std::vector<std::string> examples() {
    std::vector<std::string> paths;
    for (const auto& entry : std::filesystem::directory_iterator(kExamples)) paths.push_back(entry.path());
    return paths;
  }

  static TemporaryFolder* folder_;
  static DaemonProcess* daemon_;
  static std::string address_;
};
TemporaryFolder* RunCommandTest::folder_ = nullptr;
DaemonProcess* RunCommandTest::daemon_ = nullptr;
std::string RunCommandTest::address_;

TEST_F(RunCommandTest, EveryExamplePassesTwice) {
  EXPECT_GE(examples().size(), 3u);
  for (const std::string& example : examples()) {
    for (int time = 0; time < 2; ++time) {
      const Outcome outcome = run({"run", example});
      EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
      EXPECT_THAT(outcome.err, AllOf(HasSubstr(" expectations passed, 0 failed\n"), Not(HasSubstr(" 0 expectations"))));
    }
  }
}

TEST_F(RunCommandTest, EveryExampleCompilesWithoutServer) {
  for (const std::string& example : examples()) {
    const Outcome outcome = run({"run", example, "--dry-run"}, "unix:/nonexistent/locus.sock");
    EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
    EXPECT_THAT(outcome.out, IsEmpty());
    EXPECT_THAT(outcome.err, HasSubstr(": compiled, no mistake found"));
  }
}

TEST_F(RunCommandTest, ABrokenCopyFailsWithLineAndValue) {
  const std::string text = text_of(kExamples + "first_steps.lua");
  const size_t place = text.find("locus.expect_equal(shot.id, 7)");
  ASSERT_NE(place, std::string::npos);
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(place), '\n');
  const Outcome outcome =
      run_lua(absl::StrReplaceAll(text, {{"expect_equal(shot.id, 7)", "expect_equal(shot.id, 2)"}}));
  EXPECT_EQ(outcome.code, ExitCode::kFailed);
  EXPECT_THAT(outcome.err, HasSubstr(absl::StrCat("script.lua:", line, ": expected 2, but it is 7\n")));
  EXPECT_THAT(outcome.err, HasSubstr("2 expectations passed, 1 failed\n"));
}

TEST_F(RunCommandTest, ABatchMovesAndRelabelsInstances) {
  const Outcome outcome = run_lua(R"(
    local scene = locus.scene("lua-doors")
    locus.command("generate city --triangles 500 --seed 1 --create --scene", scene.name)
    locus.command("wait", scene.name)
    local before = locus.command("instance list", scene.name)
    local updates = scene:updates()
    updates:move_instance{ id = before.instances[1].id, at = { 7, 8, 9 }, scale = 2 }
    updates:relabel_instance{ id = before.instances[1].id, tag = 5 }
    locus.expect_equal(updates:commit{ tick = 1 }.applied, 2)
    local door = locus.command("instance list", scene.name).instances[1]
    locus.expect_equal(door.at, { 7, 8, 9 })
    locus.expect_equal(door.scale, 2)
    locus.expect_equal(door.tag, 5)
    locus.expect_error("UNKNOWN_ID", function()
      scene:updates():move_instance{ id = 1, at = { 0, 0, 0 } }:commit()
    end)
  )");
  EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
}

TEST_F(RunCommandTest, SettingsReachTheScriptAndTheEndIsJsonWhereTheOutputIs) {
  const Outcome outcome = run({"run", kExamples + "first_steps.lua", "--set", "scene=elsewhere", "-o", "ndjson"});
  EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
  const Json end = Json::parse(outcome.err);
  EXPECT_EQ(end["failed"], 0);
  EXPECT_GT(end["passed"], 5);
  EXPECT_EQ(run({"scene", "describe", "elsewhere"}).code, ExitCode::kOk);
  EXPECT_EQ(run_lua("", {"--set", "novalue"}).code, ExitCode::kUsage);
  EXPECT_EQ(run_lua("", {"--set", "=1"}).code, ExitCode::kUsage);
}

TEST_F(RunCommandTest, TheLanguageOfAFileIsItsEndingOrItsText) {
  EXPECT_EQ(run({"run", "/nonexistent/x.lua"}).code, ExitCode::kNotFound);
  EXPECT_THAT(run({"run", file_with("print(1 + 1)", ".txt")}).out, "2\n");
  EXPECT_THAT(run({"run", file_with("# comment\nscene list -o csv", ".txt")}).out, HasSubstr("name,state"));
  EXPECT_THAT(run({"run", file_with("print(1 + ", ".txt")}).err, HasSubstr("script.txt:1: unexpected symbol"));
  EXPECT_THAT(run({"run", file_with("print(1)", ".locus")}).err, HasSubstr("has no command `print(1)`"));
  EXPECT_EQ(run({"run", file_with("scene list", ".lua")}).code, ExitCode::kUsage);
}

TEST_F(RunCommandTest, LinesRunInOrderAndNameTheLineThatFails) {
  const std::string lines = "scene create lines --if-absent\ninsert lines ball --id 7 --at 0,0,0 --radius 1 --upsert\n";
  const Outcome good =
      run({"-o", "ndjson", "run", file_with(lines + "query ray lines --from 0,0,9 --dir 0,0,-1", ".locus")});
  EXPECT_EQ(good.code, ExitCode::kOk) << good.err;
  EXPECT_THAT(good.out, HasSubstr("\"id\":\"7\""));
  EXPECT_EQ(Json::parse(good.err)["lines"], 3);
  const std::string bad = file_with("get lines --id 8\n\nscene list\n", ".locus");
  const Outcome stopped = run({"run", bad});
  EXPECT_EQ(stopped.code, ExitCode::kNotFound);
  EXPECT_THAT(stopped.err, AllOf(HasSubstr("script.locus:1: "), HasSubstr("1 lines run, 1 failed")));
  const Outcome went_on = run({"run", bad, "--keep-going"});
  EXPECT_EQ(went_on.code, ExitCode::kFailed);
  EXPECT_THAT(went_on.out, HasSubstr("lines"));
  EXPECT_THAT(went_on.err, HasSubstr("2 lines run, 1 failed"));
}

TEST_F(RunCommandTest, AMistakeInTheLastLinePreventsTheFirstFromRunning) {
  const Outcome outcome = run({"run", file_with("scene create never\nquery ray arena\n", ".locus")});
  EXPECT_EQ(outcome.code, ExitCode::kUsage);
  EXPECT_THAT(outcome.out, IsEmpty());
  EXPECT_THAT(outcome.err, HasSubstr("script.locus:2: give --from and --dir"));
  EXPECT_EQ(run({"scene", "describe", "never"}).code, ExitCode::kNotFound);
}

TEST_F(RunCommandTest, ErrorsCarryTheServersReasonFieldIndexAndThePlace) {
  const Outcome outcome = run_lua(R"(
local scene = locus.scene("errors")
scene:delete{if_present = true}
scene:create()
scene:apply{inserts = {{ids = {1, 2}, positions_f64 = {{0, 0, 0}, {0, 0, 9}}, ball = {radii = 1}}}}
local _, refused = pcall(function()
  scene:query{blocks = {{balls = {centers = {{0, 0, 0}, {0, 0, 0}}, radii = {1, -1}}}}}
end)
print(refused.reason, refused.code, refused.field, refused.index, refused.file:match("[^/]+$"), refused.line)
local _, unknown = pcall(scene.apply, scene, {moves = {{ids = {3}, positions_f64 = {{0, 0, 0}}}}})
print(unknown.reason, unknown.line)
local _, missing = pcall(function() locus.scene("nowhere"):describe() end)
print(missing.reason, missing.code)
locus.scene("nowhere"):describe()
)");
  EXPECT_EQ(outcome.code, ExitCode::kNotFound);
  EXPECT_THAT(outcome.out, HasSubstr("script.lua\t7\n"));
  EXPECT_THAT(outcome.out, HasSubstr("blocks[0].balls.radii\t1\tscript.lua"));
  EXPECT_THAT(outcome.out, HasSubstr("UNKNOWN_ID\t10\n"));
  EXPECT_THAT(outcome.out, HasSubstr("NOT_FOUND\tNOT_FOUND\n"));
  EXPECT_THAT(outcome.err, HasSubstr("script.lua:14: scene: no scene is called 'nowhere'"));
}

TEST_F(RunCommandTest, IdsKeepAllBitsInEveryForm) {
  const Outcome outcome = run_lua(R"(
local scene = locus.scene("wide")
scene:delete{if_present = true}
scene:create()
local ids = {locus.id(2^53 + 0) + 1, locus.id("9223372036854775808"), locus.id("18446744073709551615")}
local updates = scene:updates()
for i, id in ipairs(ids) do updates:insert{id = id, at = {0, 0, 10 * i}, ball = 1, group = id, tag = id} end
updates:commit()
local queries = scene:queries{columns = {"id", "group", "tag"}}
for i = 1, 3 do queries:ball{at = {0, 0, 10 * i}, radius = 0.5} end
for i, found in ipairs(queries:run()) do
  locus.expect_equal(found[1].id, ids[i])
  locus.expect_equal(found[1].group, ids[i])
  locus.expect_equal(found[1].tag, ids[i])
  locus.expect_equal(locus.command("get", "wide", "--id", ids[i]).id, ids[i])
  locus.expect_equal(locus.command("query ball wide --radius 0.5 --at", {0, 0, 10 * i}).rows[1].id, ids[i])
  print(found[1].id)
end
local moved = scene:updates()
for i, id in ipairs(ids) do moved:move{id = id, at = {5, 0, 10 * i}} end
locus.expect_equal(moved:commit().applied, 3)
locus.print({{id = ids[3]}, {id = ids[1]}})
)",
                                  {"-o", "csv"});
  EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
  EXPECT_EQ(outcome.out,
            "9007199254740993\n9223372036854775808\n18446744073709551615\n"
            "id\n18446744073709551615\n9007199254740993\n");
  for (const char* format : {"json", "csv", "ndjson"}) {
    const Outcome dumped = run({"-o", format, "dump", "wide"});
    for (const char* id : {"9007199254740993", "9223372036854775808", "18446744073709551615"})
      EXPECT_THAT(dumped.out, HasSubstr(id)) << format;
  }
}

TEST_F(RunCommandTest, KeepGoingCountsFailedExpectations) {
  const std::string text =
      "locus.expect(false, 'first')\nlocus.expect_near(1, 2, 0.5)\nlocus.expect(true)\n"
      "locus.expect_error('NOT_FOUND', function() end)\nlocus.expect_error('X', error, 'thrown')\n";
  const Outcome stopped = run_lua(text);
  EXPECT_EQ(stopped.code, ExitCode::kFailed);
  EXPECT_THAT(stopped.err, HasSubstr("script.lua:1: first\n"));
  EXPECT_THAT(stopped.err, HasSubstr("0 expectations passed, 1 failed"));
  const Outcome went_on = run_lua(text, {"--keep-going"});
  EXPECT_EQ(went_on.code, ExitCode::kFailed);
  EXPECT_THAT(went_on.err, HasSubstr("script.lua:2: expected 2 within 0.5, but it is 1\n"));
  EXPECT_THAT(went_on.err, HasSubstr("script.lua:4: expected NOT_FOUND, but it succeeded\n"));
  EXPECT_THAT(went_on.err, HasSubstr("script.lua:5: expected X, but it is an error of Lua: "));
  EXPECT_THAT(went_on.err, HasSubstr("1 expectations passed, 4 failed\n"));
}

TEST_F(RunCommandTest, QueriesSeeTheScriptsOwnChangesOnAnyConnection) {
  const Outcome outcome = run_lua(absl::StrCat("local other = locus.connect('", address_, R"(')
local scene = other:scene("own")
scene:delete{if_present = true}
scene:create()
for i = 1, 50 do
  scene:updates():insert{id = i, at = {i, 0, 0}, ball = 0.1}:commit()
  locus.expect_equal(#scene:queries():ball{at = {i, 0, 0}, radius = 0.1}:run()[1], 1)
end
locus.expect_equal(locus.command("query ball own --at 25,0,0 --radius 1.5").count, nil)
locus.expect_equal(#locus.command("query ball own --at 25,0,0 --radius 1.5").rows, 3)
locus.expect_equal(#other:list_scenes() > 0, true)
)"));
  EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
}

TEST_F(RunCommandTest, EveryKindOfRowIsAnswered) {
  const Outcome outcome = run_lua(R"(
local scene = locus.scene("kinds")
scene:delete{if_present = true}
scene:create()
scene:updates()
  :insert{id = 1, at = {0, 0, 0}, ball = 1, layers = 2}
  :insert{id = 2, at = {10, 0, 0}, box = {1, 1, 1}, rotation = {0, 0, 0, 1}, group = 5}
  :insert{id = 3, at = {20, 0, 0}, capsule = {axis = {0, 0, 1}, radius = 0.5}, tag = 9}
  :insert{id = 4, at = {30, 0, 0}}
  :commit{all_or_nothing = true}
local queries = scene:queries{columns = {"id", "group", "tag", "layers"}}
queries:ray({from = {-9, 0, 0}, dir = {1, 0, 0}, mask = 1}, {columns = {"t", "id", "group"}})
queries:ray{from = {-9, 0, 0}, dir = {1, 0, 0}, t_max = 5}
queries:ball{at = {10, 0, 0}, radius = 0.5, ignore_group = 5}
queries:ball{at = {10, 0, 0}, radius = 0.5}
queries:box{at = {20, 0, 0}, half = {1, 1, 1}}
queries:capsule{from = {0, 0, 0}, to = {10, 0, 0}, radius = 0.1}
queries:sweep{from = {20, 0, 9}, to = {20, 0, -9}, radius = 0.5}
queries:nearest({at = {29, 0, 0}, max_distance = 3}, {k = 2, columns = {"t", "id"}})
queries:contains{at = {0, 0, 0.5}}
local a = queries:run()
locus.expect_equal(a[1].id, 2)
locus.expect_equal(a[1].group, 5)
locus.expect_equal(a[2], false)
locus.expect_equal(#a[3], 0)
locus.expect_equal(a[4][1].id, 2)
locus.expect_equal(a[5][1].tag, 9)
locus.expect_equal({a[6][1].id, a[6][2].id}, {1, 2})
locus.expect_equal(a[7].id, 3)
local function ids_of(rows)
  local ids = {}
  for i, row in ipairs(rows) do ids[i] = row.id end
  return ids
end
local filtered = scene:queries{columns = {"id"}}
filtered:ball{at = {10, 0, 0}, radius = 30, only_group = 5}
filtered:ball{at = {10, 0, 0}, radius = 30, tag = 9}
filtered:ball{at = {10, 0, 0}, radius = 30, tag = 1, tag_mask = 6}
filtered:ball{at = {10, 0, 0}, radius = 30, ignore_id = 2}
filtered:ball{at = {10, 0, 0}, radius = 30}
filtered:ray({from = {0, 0, 0}, dir = {0, 1, 0}, only_group = 5}, {rotation = {0, 0, -0.70710678, 0.70710678}})
local f = filtered:run()
locus.expect_equal(ids_of(f[1]), {2})
locus.expect_equal(ids_of(f[2]), {3})
locus.expect_equal(ids_of(f[3]), {1, 2, 3, 4}, "bits outside of the mask do not count")
locus.expect_equal(ids_of(f[4]), {1, 3, 4})
locus.expect_equal(ids_of(f[5]), {1, 2, 3, 4}, "the id of one row is found by the others")
locus.expect_equal(f[6].id, 2, "the rotation turns y to x")
locus.expect_error("FAILED_PRECONDITION", function() filtered:ball{at = {0, 0, 0}, radius = 1, tag_mask = 1} end)
locus.expect_equal(a[8][1].id, 4)
locus.expect_near(a[8][1].t, 1, 1e-6)
locus.expect_equal(a[9][1].id, 1)
locus.expect_equal(scene:queries():ray({from = {-9, 0, 0}, dir = {1, 0, 0}}, {mode = "any"}):run()[1], true)
scene:updates():relabel{id = 1, tag = 4}:remove(2):remove_group(7):move{id = 3, at = {0, 50, 0}, teleport = true}:commit()
locus.expect_equal(locus.command("get kinds --id 1").tag, 4)
locus.expect_equal(scene:describe().objects, 3)
locus.expect_error("an error", function() scene:updates():insert{id = 1, att = {0, 0, 0}} end)
)",
                                  {"--keep-going"});
  EXPECT_THAT(outcome.err, HasSubstr("insert has no field 'att'; did you mean `at`?"));
  EXPECT_THAT(outcome.err, HasSubstr("21 expectations passed, 1 failed")) << outcome.err;
}

TEST_F(RunCommandTest, StreamsAnswerInOrderAndKeepErrors) {
  const Outcome outcome = run_lua(R"(
local scene = locus.scene("streams")
scene:delete{if_present = true}
scene:create()
local stream = scene:update_stream()
stream:send{inserts = {{ids = {1}, positions_f64 = {{0, 0, 0}}, point = {}}}}
stream:send{all_or_nothing = true, moves = {{ids = {2}, positions_f64 = {{0, 0, 0}}}}}
locus.expect_equal(stream:send{moves = {{ids = {1}, positions_f64 = {{1, 0, 0}}}}}, 3)
local acks = stream:flush()
locus.expect_equal(#acks, 3)
locus.expect_equal(acks[1].applied, 1)
locus.expect_equal(acks[2].reason, "UNKNOWN_ID")
locus.expect_equal(acks[3].applied, 1)
locus.expect_equal(#stream:close(), 0)
local asks = scene:query_stream()
asks:send{blocks = {{balls = {centers = {1, 0, 0}, radii = {1}}}}}
locus.expect_equal(asks:flush()[1].blocks[1].ids[1], 1)
)");
  EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
}

TEST_F(RunCommandTest, AStepTakesBuildersOrColumnsAndItsQueriesSeeItsUpdates) {
  const Outcome outcome = run_lua(R"(
local scene = locus.scene("steps")
scene:delete{if_present = true}
scene:create()
local insert = scene:updates():insert{id = 1, at = {0, 0, 0}, ball = 1}
local look = scene:queries():ray{from = {-9, 0, 0}, dir = {1, 0, 0}}
local answers, result, ack = scene:step{updates = insert, queries = look, tick = 5}
locus.expect_equal(answers[1].id, 1)
locus.expect_equal({ack.applied, ack.tick, ack.revision}, {1, 5, result.revision})
local none, columns = scene:step{updates = {moves = {{ids = {1}, positions_f64 = {{7, 0, 0}}}}},
  queries = {blocks = {{columns = {"pose"}, lookup = {ids = {1}}}}}}
locus.expect_equal(none, nil)
locus.expect_equal(columns.blocks[1].positions[1], 7)
locus.expect_equal(select(3, scene:step{}).revision, ack.revision + 1)
locus.expect_equal(#look:run(), 0)
local move = scene:updates():move{id = 1, at = {3, 0, 0}}
locus.expect_error("MALFORMED", scene.step, scene, {updates = move, view = {exactly = 1}})
locus.expect_equal(scene:describe().revision, ack.revision + 1)
locus.expect_error("UNKNOWN_ID", scene.step, scene, {updates = scene:updates():move{id = 9, at = {3, 0, 0}}})
local past = scene:queries():ray({from = {-9, 0, 0}, dir = {1, 0, 0}}, {as_of_ticks = {1}})
local late = scene:updates():move{id = 1, at = {4, 0, 0}}
locus.expect_error("OUT_OF_RANGE", scene.step, scene, {updates = late, queries = past})
locus.expect_equal(scene:describe().revision, ack.revision + 2, "the update stays applied")
local stream = scene:query_stream()
stream:step({moves = {{ids = {1}, positions_f64 = {{5, 0, 0}}}}}, {blocks = {{columns = {"pose"}, lookup = {ids = {1}}}}})
stream:step({all_or_nothing = true, moves = {{ids = {9}, positions_f64 = {{0, 0, 0}}}}}, {})
locus.expect_equal(stream:send{}, 3)
stream:step({}, {blocks = {{as_of_ticks = {1}, lookup = {ids = {1}}}}})
local steps = stream:close()
locus.expect_equal(steps[1].ack.applied, 1)
locus.expect_equal(steps[1].result.blocks[1].positions[1], 5)
locus.expect_equal(steps[2].reason, "UNKNOWN_ID")
locus.expect_equal(steps[3].revision, steps[1].ack.revision)
locus.expect_equal(steps[4].result.reason, "OUT_OF_RANGE")
locus.expect_equal(scene:update_stream().step, nil)
local shared, none_asked = {moves = {{ids = {1}, positions_f64 = {{6, 0, 0}}}}}, {blocks = {}}
scene:step{updates = shared, queries = none_asked, tick = 9, view = {at_least = 1}}
locus.expect_equal(shared.tick, nil, "a step leaves the caller's tables unchanged")
locus.expect_equal(none_asked.view, nil, "a step leaves the caller's tables unchanged")
scene:step{update = move}
)",
                                  {"--keep-going"});
  EXPECT_THAT(outcome.err, HasSubstr("step has no field 'update'; did you mean `updates`?"));
  EXPECT_THAT(outcome.err, HasSubstr("20 expectations passed")) << outcome.err;
}

TEST_F(RunCommandTest, MeshesAndInstancesAreMadeFromTables) {
  const Outcome outcome = run_lua(R"(
local server = locus.connect()
local scene = server:scene("meshes")
scene:delete{if_present = true}
scene:create()
server:upload_mesh{mesh = "square", vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, indices = {{0, 1, 2}, {0, 2, 3}}}
local placed = scene:change_instances{place = {mesh = "square", translations = {{0, 0, 5}}}}
local hit = scene:queries():ray{from = {0.5, 0.25, 9}, dir = {0, 0, -1}}:run()[1]
locus.expect_equal(hit.id, placed.ids[1])
locus.expect_near(hit.t, 4, 1e-6)
scene:delete()
server:delete_mesh("square")
locus.expect_error("NOT_FOUND", server.delete_mesh, server, "square")
)");
  EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
}

TEST_F(RunCommandTest, ResultsOfBulkQueriesAndTextsAreTables) {
  const Outcome outcome = run_lua(absl::StrCat(R"(
locus.command("scene create bulk --if-absent")
locus.command("insert bulk ball --id 7 --at 0,0,0 --radius 1 --upsert")
local file = io.open(")",
                                               folder_->file("rays.csv"), R"(", "w")
file:write("from.x,from.y,from.z\n0,0,9\n5,0,9\n")
file:close()
local hits = locus.command("query ray bulk --dir 0,0,-1 --from-csv", ")",
                                               folder_->file("rays.csv"), R"(")
locus.expect_equal(#hits.rows, 2)
locus.expect_equal(hits.rows[1].id, 7)
locus.expect_equal(hits.rows[2].hit, false)
locus.expect_equal(locus.command("query ray --help").text:find("Usage") ~= nil, true)
locus.expect_error("USAGE", locus.command, "query ray bulk -a 127.0.0.1:1 --from 0,0,0 --dir 0,0,1")
locus.expect_error("USAGE", locus.command, "qury")
)"));
  EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
}

TEST_F(RunCommandTest, LimitsEndAScriptWithPlaceAndLimitAndHarmNothing) {
  const struct {
    const char* text;
    const char* message;
  } cases[] = {
      {"\nwhile true do end", "script.lua:2: the script ran more than its limit of 1000000 instructions"},
      {"\nlocal t = {} while true do t[#t + 1] = ('x'):rep(1e5) .. #t end",
       "script.lua:2: the script needs more than its limit of 16 MiB of memory"},
      {"\nos.execute('true')", "script.lua:2: os.execute is not available to scripts: run them with --unsafe"},
      {"\nlocus.expect_error('X', function() while true do end end)", "script.lua:2: the script ran more than"},
      {"\ntable.sort({2, 1}, function() error('in a callback') end)", "script.lua:2: in a callback"},
  };
  for (const auto& [text, message] : cases) {
    const Outcome outcome = run_lua(text, {"--max-instructions", "1000000", "--max-memory", "16"});
    EXPECT_EQ(outcome.code, ExitCode::kFailed) << text;
    EXPECT_THAT(outcome.err, HasSubstr(message));
  }
  const Outcome slept = run_lua("locus.sleep(3600)\nwhile true do end", {"--max-seconds", "0.05"});
  EXPECT_THAT(slept.err, HasSubstr("ran longer than its limit of 50ms (--max-seconds)"));
  EXPECT_EQ(run_lua("assert(os.execute('true'))", {"--unsafe"}).code, ExitCode::kOk);
  EXPECT_EQ(run({"health"}).code, ExitCode::kOk);
}

TEST_F(RunCommandTest, WordsOfCommandsAreFlat) {
  const Outcome outcome = run_lua(R"(
local loop = {}
loop[1] = loop
for _, word in ipairs{loop, {{1}}, {}, print, {a = 1}} do locus.expect_error("USAGE", locus.command, "scene list", word) end
locus.expect_error("USAGE", locus.command, "scene list", nil, "x")
)");
  EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("6 expectations passed"));
}

TEST_F(RunCommandTest, EqualTablesHaveEqualFields) {
  const Outcome outcome = run_lua(R"(
locus.expect_equal({a = 1, b = {2}}, {a = 1, b = {2}})
locus.expect_equal({a = 1}, {a = 2})
locus.expect_equal({a = 1}, {})
locus.expect_equal({}, {a = 1})
locus.expect_equal("7", 7)
)",
                                  {"--keep-going"});
  EXPECT_THAT(outcome.err, HasSubstr("1 expectations passed, 4 failed"));
  EXPECT_THAT(outcome.err, HasSubstr("expected {a = 2}, but it is {a = 1}"));
  EXPECT_THAT(outcome.err, HasSubstr("expected 7, but it is \"7\""));
}

TEST_F(RunCommandTest, ARefusedRowAddsNothing) {
  const Outcome outcome = run_lua(R"(
local scene = locus.scene("rows")
scene:delete{if_present = true}
scene:create()
local updates = scene:updates()
for _, row in ipairs{{id = 1}, {at = {0, 0, 0}}, {id = 1, at = {1, 2}}, {id = 1, at = {1, 2, 3, 4}},
                     {id = 1, at = {x = 1}}, {id = 1, at = {0, 0, 0}, group = {}}, {id = 1, at = {0, 0, 0}, ball = 1, box = {1, 1, 1}},
                     {id = 1, at = {0, 0, 0}, capsule = {radius = 1}}, {id = 1, at = {0, 0, 0}, rotation = {}}} do
  locus.expect_error("FAILED_PRECONDITION", updates.insert, updates, row)
end
locus.expect_error("FAILED_PRECONDITION", updates.remove, updates)
locus.expect_equal(updates:insert{id = 2, at = {0, 0, 0}, ball = 1}:commit().applied, 1)
local queries = scene:queries{columns = {"t"}}
locus.expect_error("FAILED_PRECONDITION", queries.ray, queries, {from = {0, 0}, dir = {0, 0, 1}})
queries:ray{from = {0, 0, 9}, dir = {0, 0, 1}}:ray{from = {0, 0, 9}, dir = {0, 0, -1}}
locus.expect_error("FAILED_PRECONDITION", queries.ray, queries, {from = {0, 0, 9}, dir = {0, 0, 1}}, {mode = "any"})
local answers = queries:run()
locus.expect_equal(answers[1], false)
locus.expect_near(answers[2].t, 8, 1e-6)
queries:ball{at = {0, 0, 0}, radius = -1}
locus.expect(not pcall(queries.run, queries))
locus.expect_equal(#scene:queries():ball{at = {0, 0, 0}, radius = 1}:run()[1], 1)
locus.expect_equal(scene:queries{count_only = true}:ball{at = {0, 0, 0}, radius = 1}:run()[1], 1)
)");
  EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
}

TEST_F(RunCommandTest, CutAnswersSayIt) {
  const Outcome outcome = run_lua(R"(
local scene = locus.scene("cut")
scene:delete{if_present = true}
scene:create()
local updates = scene:updates()
for i = 1, 10 do updates:insert{id = i, at = {0, 0, 0}} end
updates:commit()
local answers = scene:queries{max_results = 5}:ball{at = {0, 0, 0}, radius = 1}:ball{at = {9, 0, 0}, radius = 1}:run()
locus.expect_equal(#answers[1], 5)
locus.expect_equal(answers[1].truncated, true)
locus.expect_equal(answers[2].truncated, nil)
)");
  EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
}

TEST_F(RunCommandTest, QueriesByListFindTheSameAndDoMoreWork) {
  const Outcome outcome = run_lua(R"(
local list = locus.scene("by-list")
list:create()
local updates = list:updates()
for id = 1, 200 do updates:insert{ id = id, at = { 3 * id, 0, 0 }, ball = 1 } end
updates:commit()
local function ask(options)
  return list:queries():ball{ at = { 9, 0, 0 }, radius = 4 }:run(nil, options)
end
local found, searched = ask{ explain = true }
local listed, tested = ask{ explain = true, by_list = true }
locus.expect_equal(listed, found)
locus.expect_equal(#found[1], 3)
locus.expect(tested.work.tests >= 200 and searched.work.tests < 200, "by list every object is tested")
locus.expect(not pcall(ask, { blocks = {} }), "blocks are no option")
list:delete()
)");
  EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
}

TEST_F(RunCommandTest, ScriptsMayBeginAsPrograms) {
  EXPECT_EQ(run_lua("#!/usr/bin/env -S locus run\nprint(1)").out, "1\n");
  EXPECT_EQ(run_lua("\xEF\xBB\xBFprint(1)").out, "1\n");
}

TEST_F(RunCommandTest, PrintWritesTablesInTheFormatOfTheOutput) {
  const std::string text = "locus.print({{id = 1, t = 0.5}, {id = 2}}, {'id', 't'})\nlocus.print({revision = 5})\n";
  EXPECT_EQ(run_lua(text, {"-o", "csv"}).out, "id,t\n1,0.5\n2,\nrevision\n5\n");
  EXPECT_EQ(run_lua(text, {"-o", "ndjson"}).out, "{\"id\":\"1\",\"t\":0.5}\n{\"id\":\"2\"}\n{\"revision\":5}\n");
  EXPECT_EQ(run_lua("print(1, 'a', nil, 0.5)").out, "1\ta\tnil\t0.5\n");
  EXPECT_EQ(run_lua("locus.print(5)").code, ExitCode::kFailed);
}

}  // namespace
}  // namespace locus::cli
