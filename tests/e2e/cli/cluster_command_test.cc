// `locus cluster`, and what other commands show of a cluster, against three servers on one PostgreSQL.
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <memory>
#include <regex>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cli/output.h"
#include "tests/support/cli_outcome.h"
#include "tests/support/cli_test.h"
#include "tests/support/cluster_servers.h"
#include "tests/support/http_get.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/text_of.h"

namespace locus::test {
namespace {

using cli::ExitCode;
using cli::Json;
using ::testing::HasSubstr;
using ::testing::Not;

class ClusterCommandTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!PostgresServer::installed()) GTEST_SKIP() << PostgresServer::kMissing;
    engine_ = std::make_unique<PostgresServer>();
    for (const char* const zone : {"a", "b", "c"})
      servers_.push_back(std::make_unique<ClusterServer>(*engine_, zone, "127.0.0.1:0"));
    // A member that has just started has had no answer from the engine.
    for (size_t at = 0; at < 3; ++at)
      ASSERT_TRUE(becomes_true([&] { return run_at(at, {"cluster", "status"}).code == ExitCode::kOk; }));
    ASSERT_TRUE(becomes_true([&] { return status_at(0)["members"].size() == 3; }));
  }

  const std::string& address(size_t at) const { return servers_[at]->address(); }
  Outcome run_at(size_t at, const std::vector<std::string>& line) { return run_cli(address(at), line); }
  Json json_at(size_t at, std::vector<std::string> line) {
    line.insert(line.begin(), {"-o", "json"});
    const Outcome outcome = run_at(at, line);
    EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
    return Json::parse(outcome.out, nullptr, /*allow_exceptions=*/false);
  }
  Json status_at(size_t at) { return json_at(at, {"cluster", "status"}); }
  void create(int count) {
    for (int i = 0; i < count; ++i)
      ASSERT_EQ(run_at(static_cast<size_t>(i) % 3, {"scene", "create", absl::StrCat("scene", i)}).code, ExitCode::kOk);
  }
  // Returns the leader of each scene, as the map says it.
  std::map<std::string, std::string> leaders(size_t at = 0) {
    std::map<std::string, std::string> found;
    const Json map = json_at(at, {"cluster", "map"});
    for (const Json& row : map["scenes"]) found[row["scene"]] = row["leader"];
    return found;
  }
  // Returns the index of the server that leads the scene.
  size_t leader_of(const std::string& scene) {
    const std::string leader = leaders()[scene];
    for (size_t at = 0; at < servers_.size(); ++at)
      if (address(at) == leader) return at;
    ADD_FAILURE() << scene << " is led by nobody: " << leader;
    return 0;
  }
  // Inserts an object at the leader, which may still begin to lead.
  void insert_into_scene0(size_t leader) {
    ASSERT_TRUE(becomes_true([&] {
      return run_at(leader, {"insert", "scene0", "ball", "--id", "7", "--at", "0,0,0", "--radius", "1"}).err.empty();
    }));
  }
  void gather_at(size_t at, int count) {
    for (int i = 0; i < count; ++i) {
      const std::string scene = absl::StrCat("scene", i);
      if (leader_of(scene) == at) continue;
      const Outcome outcome = run_at(0, {"cluster", "move", scene, address(at)});
      ASSERT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
    }
  }
  std::string metrics_at(size_t at) { return http_get(servers_[at]->server().http_port(), "/metrics").body; }

  std::unique_ptr<PostgresServer> engine_;  // null if PostgreSQL is not installed
  std::vector<std::unique_ptr<ClusterServer>> servers_;
};

TEST_F(ClusterCommandTest, TheStatusOfEveryServerHasTheMembersTheEngineAndTheScenesOfEach) {
  create(6);
  for (size_t at = 0; at < 3; ++at) {
    ASSERT_TRUE(becomes_true([&] { return status_at(at)["members"].size() == 3; }));
    const Json status = status_at(at);
    EXPECT_EQ(status["engine_answers"], true);
    EXPECT_THAT(std::string(status["engine"]), HasSubstr(engine_->socket_folder()));
    EXPECT_EQ(status["scenes"], 6);
    EXPECT_EQ(status["no_leader"], 0);
    int scenes = 0;
    std::set<std::string> zones;
    for (const Json& member : status["members"]) {
      scenes += member["scenes"].get<int>();
      zones.insert(member["zone"]);
      EXPECT_EQ(member["this"], member["address"] == address(at));
      EXPECT_EQ(member["draining"], false);
    }
    EXPECT_EQ(scenes, 6);
    EXPECT_EQ(zones, (std::set<std::string>{"a", "b", "c"}));
  }
  EXPECT_EQ(Json::parse(run_at(0, {"cluster", "status", "--json"}).out).size(), status_at(0).size());
  EXPECT_THAT(run_at(0, {"cluster", "status"}).out, HasSubstr("address"));
}

TEST_F(ClusterCommandTest, AMoveFindsTheLeaderAndScenesShowTheirNewOne) {
  create(1);
  const size_t leader = leader_of("scene0");
  const size_t next = (leader + 1) % 3, third = (leader + 2) % 3;
  insert_into_scene0(leader);
  const Json moved = json_at(third, {"cluster", "move", "scene0", address(next)});
  EXPECT_EQ(moved["leader"], address(next));
  EXPECT_EQ(leader_of("scene0"), next);
  Json described;
  ASSERT_TRUE(becomes_true([&] {
    const Outcome outcome = run_at(next, {"-o", "json", "scene", "get", "scene0"});
    if (outcome.code == ExitCode::kOk) described = Json::parse(outcome.out);
    return outcome.code == ExitCode::kOk;
  }));
  EXPECT_EQ(described["role"], "leading");
  EXPECT_EQ(described["leader"], address(next));
  EXPECT_EQ(described["token"], moved["token"]);
  EXPECT_EQ(described["objects"], 1);
  const Json listed = json_at(third, {"scene", "list"})["scenes"][0];
  EXPECT_EQ(listed["role"], "elsewhere");
  EXPECT_EQ(listed["leader"], address(next));
  EXPECT_EQ(listed["objects"], nullptr) << "only its leader knows its objects";

  const Json again = json_at(third, {"cluster", "move", "scene0", address(next)});
  EXPECT_EQ(again, moved) << "it leads the scene already";
  EXPECT_THAT(run_at(third, {"cluster", "move", "scene0"}).out, HasSubstr(" leads scene0\n"));
  EXPECT_NE(leader_of("scene0"), next) << "the server chooses another one";
  // The new leader may still be reading the scene, which is UNAVAILABLE.
  EXPECT_TRUE(becomes_true([&] {
    return run_at(0, {"cluster", "move", "scene0", "127.0.0.1:1"}).code == ExitCode::kNotFound;
  }));
  EXPECT_EQ(run_at(0, {"cluster", "move", "nowhere"}).code, ExitCode::kNotFound);
}

TEST_F(ClusterCommandTest, ADrainedMemberLeadsNothingAndTheOthersLeadAllAlike) {
  constexpr int kScenes = 8;
  create(kScenes);
  gather_at(1, kScenes);
  const Outcome outcome = run_at(0, {"-o", "json", "--progress", "always", "cluster", "drain", address(1)});
  EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("reading loads"));
  EXPECT_THAT(outcome.err, HasSubstr("moving"));
  const Json drained = Json::parse(outcome.out);
  EXPECT_EQ(drained["moved"], kScenes);
  EXPECT_EQ(drained["remaining"].size(), 0u);
  std::map<std::string, int> counts;
  for (const auto& [scene, leader] : leaders(1)) ++counts[leader];
  EXPECT_EQ(counts, (std::map<std::string, int>{{address(0), kScenes / 2}, {address(2), kScenes / 2}}));
  const Outcome again = run_at(1, {"cluster", "drain", address(1)});
  EXPECT_EQ(again.code, ExitCode::kOk) << again.err;
  EXPECT_EQ(again.out, absl::StrCat("moved 0 scenes from ", address(1), ", which leads none now\n"));
}

TEST_F(ClusterCommandTest, ScenesInMemoryStayUntilTheLineSaysThatTheirObjectsMayBeLost) {
  v1::CreateSceneRequest request;
  request.set_name("dust");
  request.mutable_spec()->set_durability(v1::DURABILITY_MEMORY);
  grpc::ClientContext creating;
  set_timeout(creating);
  v1::CreateSceneResponse created;
  ASSERT_TRUE(servers_[0]->stubs().scenes->CreateScene(&creating, request, &created).ok());
  const size_t leader = leader_of("dust");
  const Outcome refused = run_at((leader + 1) % 3, {"cluster", "move", "dust"});
  EXPECT_EQ(refused.code, ExitCode::kFailed);
  EXPECT_THAT(refused.err, HasSubstr("--with-memory"));
  const Outcome drained = run_at(0, {"cluster", "drain", address(leader)});
  EXPECT_EQ(drained.code, ExitCode::kFailed);
  EXPECT_THAT(drained.out, HasSubstr("--with-memory"));
  EXPECT_EQ(leader_of("dust"), leader);
  EXPECT_EQ(json_at(0, {"cluster", "drain", address(leader), "--with-memory"})["moved"], 1);
  EXPECT_NE(leader_of("dust"), leader);
  EXPECT_EQ(run_at(leader, {"cluster", "move", "dust", address(leader), "--with-memory"}).code, ExitCode::kOk);
}

TEST_F(ClusterCommandTest, RebalancingMovesWhatItPlanned) {
  constexpr int kScenes = 9;
  create(kScenes);
  gather_at(2, kScenes);
  const std::map<std::string, std::string> before = leaders();
  const Json planned = json_at(0, {"cluster", "rebalance", "--dry-run"});
  EXPECT_EQ(planned["moves"].size(), 6u);
  EXPECT_EQ(planned["busiest"], 9'000);
  EXPECT_EQ(planned["busiest_after"], 3'000);
  EXPECT_EQ(leaders(), before) << "--dry-run moves nothing";

  const Json made = json_at(0, {"cluster", "rebalance"});
  EXPECT_EQ(made["moves"].size(), 6u);
  for (const Json& move : made["moves"]) EXPECT_EQ(move["outcome"], "moved") << move.dump();
  std::map<std::string, int> counts;
  for (const auto& [scene, leader] : leaders()) ++counts[leader];
  for (size_t at = 0; at < 3; ++at) EXPECT_EQ(counts[address(at)], 3) << at;
  EXPECT_THAT(run_at(1, {"cluster", "rebalance"}).out, HasSubstr("no moves"));
}

TEST_F(ClusterCommandTest, TheMapIsTheSameAtEveryServerAndReplacesAFileInOneStep) {
  create(4);
  const std::string lines = run_at(0, {"cluster", "map"}).out;
  std::vector<std::string> scenes;
  for (const absl::string_view line : absl::StrSplit(lines, '\n', absl::SkipEmpty()))
    scenes.emplace_back(line.substr(0, line.find(' ')));
  EXPECT_EQ(scenes, (std::vector<std::string>{"scene0", "scene1", "scene2", "scene3"}));
  for (size_t at = 1; at < 3; ++at)
    EXPECT_TRUE(becomes_true([&] { return run_at(at, {"cluster", "map"}).out == lines; })) << at;

  const TemporaryFolder folder;
  const std::string file = folder.file("scenes.map");
  std::ofstream(file) << "old 127.0.0.1:1\n";
  const std::ifstream reader(file);
  EXPECT_EQ(run_at(0, {"cluster", "map", file}).out, absl::StrCat(file, ": 4 scenes\n"));
  EXPECT_EQ(text_of(file), lines);
  std::ostringstream old;
  old << reader.rdbuf();
  EXPECT_EQ(old.str(), "old 127.0.0.1:1\n") << "a reader that had opened the file reads all of the old one";
  struct stat facts {};
  ASSERT_EQ(stat(file.c_str(), &facts), 0);
  EXPECT_EQ(facts.st_mode & 0777, 0644u) << "the proxy is another user";
}

TEST_F(ClusterCommandTest, WithoutTheEngineTheStatusSaysSoAndTheMapStays) {
  create(2);
  const TemporaryFolder folder;
  const std::string file = folder.file("scenes.map");
  ASSERT_EQ(run_at(0, {"cluster", "map", file}).code, ExitCode::kOk);
  const std::string lines = text_of(file);
  engine_->stop(SIGKILL);
  ASSERT_TRUE(becomes_true([&] { return run_at(0, {"cluster", "status"}).code == ExitCode::kFailed; }));
  const Outcome status = run_at(0, {"-o", "json", "cluster", "status"});
  EXPECT_EQ(Json::parse(status.out)["engine_answers"], false);
  EXPECT_EQ(Json::parse(status.out)["members"].size(), 3u);
  EXPECT_NE(run_at(0, {"--timeout", "3", "cluster", "map", file}).code, ExitCode::kOk);
  EXPECT_EQ(text_of(file), lines);
  EXPECT_THAT(metrics_at(0), HasSubstr("\nlocus_cluster_engine_up 0\n"));
  engine_->start();
  EXPECT_TRUE(becomes_true([&] { return run_at(0, {"cluster", "status"}).code == ExitCode::kOk; }));
}

// Returns the value of a metric without labels; negative if the page has none.
double metric_of(const std::string& page, const std::string& name) {
  std::smatch found;
  return std::regex_search(page, found, std::regex("\n" + name + " ([0-9.e+]+)\n")) ? std::stod(found[1]) : -1;
}

TEST_F(ClusterCommandTest, MetricsAndTopShowTheRolesTheMembersAndTheEngine) {
  create(1);
  const size_t leader = leader_of("scene0");
  insert_into_scene0(leader);
  const std::string page = metrics_at(leader);
  EXPECT_EQ(metric_of(page, "locus_cluster_leading"), 1);
  EXPECT_EQ(metric_of(page, "locus_cluster_leaderships_total"), 1);
  EXPECT_EQ(metric_of(page, "locus_cluster_fenced_total"), 0);
  EXPECT_EQ(metric_of(page, "locus_cluster_engine_up"), 1);
  EXPECT_GE(metric_of(page, "locus_cluster_append_seconds_count"), 1);
  EXPECT_GT(metric_of(page, "locus_cluster_append_seconds_sum"), 0);
  EXPECT_THAT(page, HasSubstr("\nlocus_scene_leading{scene=\"scene0\"} 1\n"));
  EXPECT_TRUE(becomes_true([&] { return metric_of(metrics_at(leader), "locus_cluster_members") == 3; }));

  const std::string http = absl::StrCat("127.0.0.1:", servers_[leader]->server().http_port());
  const Json top = json_at(leader, {"top", "--metrics-address", http, "--once", "--interval", "0.1"});
  EXPECT_EQ(top["scenes"][0]["role"], "leading");
  EXPECT_EQ(top["server"]["members"], 3);
  EXPECT_EQ(top["server"]["leading"], 1);
  EXPECT_EQ(top["server"]["engine_up"], true);

  ASSERT_EQ(run_at(leader, {"cluster", "move", "scene0"}).code, ExitCode::kOk);
  EXPECT_TRUE(becomes_true([&] { return metric_of(metrics_at(leader), "locus_cluster_leading") == 0; }));
  EXPECT_THAT(metrics_at(leader), Not(HasSubstr("locus_scene_leading{")));
}

// Returns the metrics that the documentation says only a member of a cluster has.
std::set<std::string> documented_metrics() {
  std::set<std::string> names;
  std::ifstream readme(absl::StrCat(LOCUS_SOURCE_DIR, "/deploy/dashboards/README.md"));
  const std::regex name_in_row("`(locus_[a-z_]+)`");
  for (std::string line; std::getline(readme, line);) {
    const std::string row = line.substr(0, line.find(" in a cluster: "));
    if (row.size() == line.size()) continue;
    for (std::sregex_iterator at(row.begin(), row.end(), name_in_row), end; at != end; ++at) names.insert((*at)[1]);
  }
  return names;
}

// Returns the metrics of the page that begin with `begin`.
std::set<std::string> scraped_metrics(const std::string& page, const std::string& begin) {
  std::set<std::string> names;
  const std::regex type_line("# TYPE (" + begin + "[a-z_]*) ");
  for (std::sregex_iterator at(page.begin(), page.end(), type_line), end; at != end; ++at) names.insert((*at)[1]);
  return names;
}

TEST_F(ClusterCommandTest, EveryMetricOfAClusterIsDocumented) {
  create(1);
  const std::string page = metrics_at(leader_of("scene0"));
  std::set<std::string> scraped = scraped_metrics(page, "locus_cluster_");
  scraped.merge(scraped_metrics(page, "locus_scene_leading"));
  EXPECT_EQ(scraped, documented_metrics());
  EXPECT_EQ(scraped.size(), 7u);
}

class NoClusterCommandTest : public CliTest {
 protected:
  static server::ServerConfig config() {
    server::ServerConfig config = test_config();
    config.http_listen = "127.0.0.1:0";
    return config;
  }
  NoClusterCommandTest() : CliTest(config()) {}
};

TEST_F(NoClusterCommandTest, AServerAloneShowsNothingOfAClusterAndSaysThatItHasNone) {
  const Outcome refused = run({"cluster", "status"});
  EXPECT_EQ(refused.code, ExitCode::kFailed);
  EXPECT_THAT(refused.err, HasSubstr("belongs to no cluster: it was started without --cluster"));
  const Json listed = json_of({"scene", "list"})["scenes"][0];
  const Json described = json_of({"scene", "get", "world"});
  for (const char* const key : {"role", "leader", "token"}) {
    EXPECT_FALSE(listed.contains(key)) << key;
    EXPECT_FALSE(described.contains(key)) << key;
  }
  const std::string page = http_get(running_.server().http_port(), "/metrics").body;
  EXPECT_THAT(page, HasSubstr("locus_scene_objects{"));
  EXPECT_THAT(page, Not(HasSubstr("locus_cluster_")));
  EXPECT_THAT(page, Not(HasSubstr("locus_scene_leading")));
}

}  // namespace
}  // namespace locus::test
