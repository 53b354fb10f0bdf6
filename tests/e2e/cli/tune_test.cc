// `locus tune` against a real server. Only what it makes, reports and cleans up is checked, not its times; the choice
// among figures is tested in tests/client/cli/extras/tune.
#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>
#include <map>
#include <sstream>
#include <thread>

#include "client/cli/run.h"
#include "tests/support/built_program.h"
#include "tests/support/child_process.h"
#include "tests/support/cli_test.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/text_of.h"

namespace locus::test {
namespace {

using cli::Json;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr auto kScratchDeadline = std::chrono::seconds(20);

class TuneTestBase : public CliTest {
 protected:
  using CliTest::CliTest;

  // Returns whether a scratch scene was seen before the deadline.
  bool wait_for_scratch() {
    const auto end = std::chrono::steady_clock::now() + kScratchDeadline;
    while (std::chrono::steady_clock::now() < end) {
      for (const std::string& name : scenes())
        if (name.starts_with("tune-")) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }

  TemporaryFolder folder_;
};

// Scene `world` with a city and 600 balls in a row.
class TuneTest : public TuneTestBase {
 protected:
  TuneTest() : TuneTestBase(test_config()) {}

  void SetUp() override {
    RpcTest::SetUp();
    const Outcome city = run({"generate", "city", "--triangles", "2000", "--seed", "1", "--scene", "world"});
    ASSERT_EQ(city.code, cli::ExitCode::kOk) << city.err;
    ASSERT_TRUE(apply(insert_balls(100, 699)).ok());
  }

  std::string file(const std::string& name, const std::string& text) {
    std::ofstream(folder_.file(name)) << text;
    return folder_.file(name);
  }
  std::string balls_file() {
    std::string rows = "at.x,at.y,at.z,radius\n";
    for (int i = 100; i < 180; ++i) absl::StrAppend(&rows, 3 * i, ",0,0,20\n");
    return file("balls.csv", rows);
  }
};

TEST_F(TuneTest, MadeQueriesGiveATableOfEveryKindAndTheScratchScenesGo) {
  const uint64_t revision = get("world").revision();
  const Json report = json_of({"tune", "world", "--rounds", "1"});
  ASSERT_GE(report["sizes"].size(), 5u) << report;
  int present = 0;
  std::vector<std::string> settings;
  for (const Json& row : report["sizes"]) {
    for (const char* kind : {"rays", "balls", "boxes", "nearest"}) {
      EXPECT_TRUE(row[absl::StrCat(kind, "_ns")].is_number()) << row;
      EXPECT_GT(row[absl::StrCat(kind, "_work")].get<double>(), 0) << row;
    }
    EXPECT_TRUE(row["build_ms"].is_number());
    EXPECT_GT(row["bytes"], 0);
    EXPECT_GT(row["time"], 0);
    present += row["present"].get<bool>() ? 1 : 0;
    settings.push_back(row["setting"].dump());
  }
  EXPECT_EQ(present, 1) << report;
  EXPECT_THAT(settings, Contains("\"chosen\""));
  EXPECT_EQ(report["queries"], 4096);
  EXPECT_EQ(report["revision"], revision);
  EXPECT_THAT(scenes(), ElementsAre("world"));
  EXPECT_EQ(get("world").revision(), revision) << "the scene is only read";
}

TEST_F(TuneTest, RowsOfFilesAreAskedAndGivenSizesAreMeasured) {
  const std::string rays = file("rays.ndjson", R"({"from": [300, 0, 0], "dir": [1, 0, 0]})"
                                               "\n");
  const Json report =
      json_of({"tune", "world", "--queries", balls_file(), "--queries", rays, "--sizes", "2,8,64", "--rounds", "1"});
  EXPECT_EQ(report["queries"], 81);
  std::vector<double> sizes;
  for (const Json& row : report["sizes"]) {
    sizes.push_back(row["cell_size"]);
    EXPECT_GT(row["balls_work"].get<double>(), 0);
    EXPECT_GT(row["rays_work"].get<double>(), 0);
    EXPECT_FALSE(row.contains("nearest_ns"));
  }
  EXPECT_THAT(sizes, AllOf(Contains(2.0), Contains(8.0), Contains(64.0)));
}

TEST_F(TuneTest, ATableEndsWithTheAdvice) {
  const Outcome outcome = run({"tune", "world", "--queries", balls_file(), "--rounds", "1"});
  EXPECT_EQ(outcome.code, cli::ExitCode::kOk) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("balls_ns"));
  const std::string last = outcome.out.substr(outcome.out.rfind('\n', outcome.out.size() - 2) + 1);
  EXPECT_TRUE(last.starts_with("set it: `locus scene update world --cell-size ") || last.starts_with("leave it: "))
      << last;
}

// A few cells of 4 km hold all 9,600 objects, so that each ball of 20 m tests thousands of them: cells of 16 m take a
// small part of that work.
TEST_F(TuneTest, ApplySetsTheNamedCellSize) {
  ASSERT_TRUE(apply(insert_balls(1000, 9999)).ok());
  ASSERT_EQ(run({"scene", "update", "world", "--cell-size", "4096"}).code, cli::ExitCode::kOk);
  const std::vector<std::string> line = {"tune", "world", "--queries", balls_file(), "--sizes", "16", "--rounds", "3"};
  Json report = json_of(line);
  EXPECT_TRUE(report["set"].is_number()) << report;
  EXPECT_THAT(std::string(report["advice"]), HasSubstr("--cell-size"));
  EXPECT_EQ(get("world").spec().cell_size(), 4096) << "nothing is set without --apply";
  std::vector<std::string> apply_line = line;
  apply_line.push_back("--apply");
  report = json_of(apply_line);
  EXPECT_EQ(report["applied"], true);
  EXPECT_GE(report["gain_percent"], 10);
  EXPECT_EQ(get("world").spec().cell_size(), report["set"].get<double>());
  EXPECT_NE(get("world").spec().cell_size(), 4096);
}

TEST_F(TuneTest, TheOnlySizeIsLeftAndApplyChangesNothing) {
  const Json first = json_of({"tune", "world", "--queries", balls_file(), "--sizes", "8", "--rounds", "1"});
  std::string present;
  for (const Json& row : first["sizes"])
    if (row["present"].get<bool>()) present = row["cell_size"].dump();
  const Json report =
      json_of({"tune", "world", "--queries", balls_file(), "--sizes", present, "--rounds", "1", "--apply"});
  EXPECT_EQ(report["sizes"].size(), 1u) << report;
  EXPECT_TRUE(report["set"].is_null());
  EXPECT_EQ(report["applied"], false);
  EXPECT_THAT(std::string(report["advice"]), HasSubstr("leave it"));
  EXPECT_EQ(get("world").spec().cell_size(), 0);
}

TEST_F(TuneTest, StructuresAreTimedOnObjectsAndTriangles) {
  const std::vector<std::string> line = {"tune", "world", "--structures", "--sizes", "8", "--rounds", "1"};
  const Json report = json_of(line);
  EXPECT_EQ(report["objects"], 600);
  EXPECT_GE(report["triangles"], 1000);
  EXPECT_GE(report["sizes"].size(), 1u);
  std::map<std::string, std::vector<std::string>> names;
  for (const Json& row : report["structures"]) {
    names[row["values"]].push_back(row["structure"]);
    EXPECT_TRUE(row["bytes"].is_number()) << row;
    EXPECT_TRUE(row["build_ms"].is_number()) << row;
    for (const char* kind : {"rays", "balls", "boxes", "nearest"}) EXPECT_GT(row[absl::StrCat(kind, "_ns")], 0) << row;
  }
  const auto family = ElementsAre("list", "bvh", "hash_grid", "grid", "kd_tree", "octree", "bsp_tree", "sphere_tree");
  EXPECT_THAT(names["objects"], family);
  EXPECT_THAT(names["triangles"], family);
  for (const char* best : {"best_for_objects", "best_for_triangles"}) EXPECT_EQ(report[best].size(), 4u) << report;
  const Outcome table = run(line);
  EXPECT_THAT(table.out, AllOf(HasSubstr("kd_tree"), HasSubstr("of 600 objects, the best: ")));
}

TEST_F(TuneTest, StructuresOfASceneWithoutObjectsAreTimedOnItsTriangles) {
  v1::SceneSpec spec;
  spec.set_static_from("world");
  ASSERT_TRUE(create("city", spec).ok());
  const Json report = json_of({"tune", "city", "--structures", "--rounds", "1"});
  EXPECT_EQ(report["structures"].size(), 8u);
  EXPECT_TRUE(report["advice"].is_null());
  EXPECT_EQ(run({"tune", "city"}).code, cli::ExitCode::kFailed) << "there are no objects";
  EXPECT_THAT(scenes(), ElementsAre("city", "world"));
}

TEST_F(TuneTest, AnErrorOnTheWayNamesItsLineAndLeavesNoScratchScene) {
  const std::string refused = file("refused.ndjson", R"({"at": [300, 0, 0], "radius": 5})"
                                                     "\n"
                                                     R"({"at": [300, 0, 0], "radius": -5})"
                                                     "\n");
  const Outcome outcome = run({"tune", "world", "--queries", refused, "--rounds", "1"});
  EXPECT_EQ(outcome.code, cli::ExitCode::kFailed);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("refused.ndjson"), HasSubstr("radii")));
  EXPECT_THAT(scenes(), ElementsAre("world"));
}

TEST_F(TuneTest, ACancelledRunLeavesNoScratchScene) {
  std::ostringstream out, err;
  cli::Context context(out, err, cli::Progress::kSilent);
  std::atomic<bool> ended = false;
  cli::ExitCode code = cli::ExitCode::kOk;
  std::thread runs([&] {
    code = cli::run_line({"--address", running_.address(), "tune", "world", "--rounds", "1000"}, context);
    ended = true;
  });
  EXPECT_TRUE(wait_for_scratch());
  while (!ended) {
    context.cancel_calls();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  runs.join();
  EXPECT_EQ(code, cli::ExitCode::kFailed) << err.str();
  EXPECT_THAT(scenes(), ElementsAre("world"));
}

TEST_F(TuneTest, CtrlCLeavesNoScratchScene) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const std::string log = folder_.file("locus.log");
    ChildProcess locus(built_program("locus"), {"--address", running_.address(), "tune", "world", "--rounds", "1000"},
                       log);
    EXPECT_TRUE(wait_for_scratch());
    locus.signal(signal);
    EXPECT_EQ(locus.wait(), 1);
    EXPECT_THAT(text_of(log), HasSubstr("interrupted"));
    EXPECT_THAT(scenes(), ElementsAre("world"));
  }
}

TEST_F(TuneTest, ScratchScenesSayWhatTheyAreAndExpire) {
  ChildProcess locus(built_program("locus"), {"--address", running_.address(), "tune", "world", "--rounds", "1000"},
                     folder_.file("locus.log"));
  ASSERT_TRUE(wait_for_scratch());
  for (const std::string& name : scenes()) {
    if (!name.starts_with("tune-")) continue;
    const v1::SceneSpec spec = get(name).spec();
    EXPECT_EQ(spec.labels().at("made-by"), "locus tune");
    EXPECT_EQ(spec.labels().at("scratch-of"), "world");
    EXPECT_EQ(spec.idle_ttl_s(), 3600u);
    EXPECT_EQ(spec.history_ticks(), 0u);
    break;
  }
  locus.signal(SIGINT);
  EXPECT_EQ(locus.wait(), 1);
}

TEST_F(TuneTest, MistakesAreNamedAndNothingIsMade) {
  ASSERT_TRUE(create("empty").ok());
  Outcome outcome = run({"tune", "empty"});
  EXPECT_EQ(outcome.code, cli::ExitCode::kFailed);
  EXPECT_THAT(outcome.err, HasSubstr("scene empty has no objects"));
  outcome = run({"tune", "world", "--queries", folder_.file("missing.csv")});
  EXPECT_EQ(outcome.code, cli::ExitCode::kNotFound);
  EXPECT_THAT(outcome.err, HasSubstr("missing.csv"));
  ASSERT_TRUE(create("gone").ok());
  ASSERT_TRUE(remove("gone").ok());
  outcome = run({"tune", "gone"});
  EXPECT_EQ(outcome.code, cli::ExitCode::kNotFound);
  EXPECT_THAT(outcome.err, HasSubstr("gone"));
  outcome = run({"tune", "world", "--sizes", "3"});
  EXPECT_EQ(outcome.code, cli::ExitCode::kUsage);
  EXPECT_THAT(outcome.err, HasSubstr("powers of two"));
  EXPECT_EQ(run({"tune", "world", "--kind", "ball"}).code, cli::ExitCode::kUsage);
  EXPECT_THAT(scenes(), ElementsAre("empty", "world"));
}

server::ServerConfig little_memory() {
  server::ServerConfig config = test_config();
  config.memory_limit = uint64_t{512} << 20;
  return config;
}

class TuneInLittleMemoryTest : public TuneTestBase {
 protected:
  TuneInLittleMemoryTest() : TuneTestBase(little_memory()) {}
};

TEST_F(TuneInLittleMemoryTest, TooLittleMemoryIsRefusedWithBothFigures) {
  for (uint64_t first = 1; first <= 900'000; first += 100'000)
    ASSERT_TRUE(apply(insert_balls(first, first + 99'999)).ok());
  const Outcome outcome = run({"tune", "world"});
  EXPECT_EQ(outcome.code, cli::ExitCode::kFailed);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("6 scratch scenes"), HasSubstr("memory_bytes"), HasSubstr("of 536870912"),
                                 HasSubstr("nothing was made")));
  EXPECT_THAT(scenes(), ElementsAre("world"));
}

server::ServerConfig few_scenes() {
  server::ServerConfig config = test_config();
  config.max_scenes = 4;
  return config;
}

class TuneAmongFewScenesTest : public TuneTestBase {
 protected:
  TuneAmongFewScenesTest() : TuneTestBase(few_scenes()) {}
};

TEST_F(TuneAmongFewScenesTest, TooFewScenesAreRefusedWithBothFigures) {
  ASSERT_TRUE(apply(insert_balls(1, 10)).ok());
  const Outcome outcome = run({"tune", "world"});
  EXPECT_EQ(outcome.code, cli::ExitCode::kFailed);
  EXPECT_THAT(outcome.err, HasSubstr("which need 6 of scenes, but only 3 of 4 are free"));
  EXPECT_EQ(run({"tune", "world", "--sizes", "4", "--rounds", "1"}).code, cli::ExitCode::kOk) << "three fit";
}

}  // namespace
}  // namespace locus::test
