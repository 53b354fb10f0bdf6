// Commands that read and write scenes as files, against a real server: they import generated levels, dump scenes and
// export them.
#include <unistd.h>

#include <fstream>
#include <sstream>

#include "client/cli/levels/import/import_file.h"
#include "client/cli/run.h"
#include "tests/client/cli/levels/export/glb_file.h"
#include "tests/support/cli_outcome.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using cli::Json;
using ::testing::HasSubstr;

class SceneFilesTest : public RpcTest {
 protected:
  ~SceneFilesTest() override { unlink(path_.c_str()); }

  Outcome run(const std::vector<std::string>& arguments) { return run_cli(running_.address(), arguments); }

  std::string text_of(const std::vector<std::string>& arguments) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, cli::ExitCode::kOk) << outcome.err;
    return outcome.out;
  }

  Json json_of(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"-o", "json"});
    return Json::parse(text_of(arguments), nullptr, /*allow_exceptions=*/false);
  }

  // Inserts one object of each shape, and places a city twice.
  void fill_world() {
    for (const std::vector<std::string>& line : std::vector<std::vector<std::string>>{
             {"generate", "city", "--triangles", "600", "--scene", "world", "--mesh", "city", "--id", "100"},
             {"generate", "city", "--triangles", "600", "--scene", "world", "--mesh", "city", "--id", "101", "--at",
              "500,0,0"},
             {"insert", "world", "ball", "--id", "7", "--at", "1,2,3", "--radius", "0.5", "--group", "3", "--tag",
              "42"},
             {"insert", "world", "point", "--id", "8", "--at", "0.1,0,0", "--layers", "6"},
             {"insert", "world", "box", "--id", "9", "--at", "4,0,0", "--half", "1,1,2"},
             {"insert", "world", "capsule", "--id", "10", "--at", "0,3,0", "--axis", "0,0.5,0", "--radius", "0.25"}})
      text_of(line);
  }

  const std::string path_ = ::testing::TempDir() + "scene_files_test_" + std::to_string(getpid()) + ".glb";
};

TEST_F(SceneFilesTest, AFailedPlacementLeavesNoMesh) {
  EXPECT_EQ(run({"generate", "city", "--triangles", "600", "--scene", "nowhere"}).code, cli::ExitCode::kNotFound);
  EXPECT_EQ(json_of({"mesh", "list"})["meshes"], Json::array());
  text_of({"insert", "world", "point", "--id", "100", "--at", "0,0,0"});
  const std::vector<std::string> taken = {"generate", "blob",   "--triangles", "600",  "--scene",
                                          "world",    "--mesh", "blob",        "--id", "100"};
  EXPECT_EQ(run(taken).code, cli::ExitCode::kFailed);
  EXPECT_EQ(json_of({"mesh", "list"})["meshes"], Json::array());
}

TEST_F(SceneFilesTest, InstancesArePlacedListedAndRemoved) {
  fill_world();
  const Json placed = json_of({"instance", "place", "world", "--mesh", "city", "--at", "0,0,50", "--at", "0,0,90",
                               "--id", "200", "--id", "201", "--scale", "0.5", "--group", "4"});
  EXPECT_EQ(placed["instances"], (Json{{{"id", "200"}}, {{"id", "201"}}}));
  const Json all = json_of({"instance", "list", "world"})["instances"];
  ASSERT_EQ(all.size(), 4u) << "no objects";
  EXPECT_EQ(all[3].dump(),
            R"({"id":"201","mesh":"city","at":[0.0,0.0,90.0],"rotation":[0.0,0.0,0.0,1.0],"scale":0.5,"layers":1,)"
            R"("group":"4","tag":"0"})");
  const Outcome used = run({"mesh", "delete", "city"});
  EXPECT_THAT(used.err, HasSubstr("hint: `locus instance list SCENE`"));
  text_of({"instance", "move", "world", "--id", "201", "--to", "0,0,95", "--rotation", "0,0,1,0"});
  text_of({"instance", "relabel", "world", "--id", "201", "--layers", "0", "--tag", "6"});
  EXPECT_EQ(json_of({"instance", "list", "world"})["instances"][3].dump(),
            R"({"id":"201","mesh":"city","at":[0.0,0.0,95.0],"rotation":[0.0,0.0,1.0,0.0],"scale":0.5,"layers":0,)"
            R"("group":"4","tag":"6"})");
  EXPECT_EQ(run({"instance", "relabel", "world", "--id", "201"}).code, cli::ExitCode::kUsage);
  EXPECT_EQ(run({"instance", "move", "world", "--id", "999", "--to", "0,0,0"}).code, cli::ExitCode::kNotFound);
  text_of({"instance", "remove", "world", "--id", "100", "--group", "4"});
  EXPECT_EQ(json_of({"instance", "list", "world"})["instances"].size(), 1u);
  text_of({"instance", "remove", "world", "--id", "101"});
  EXPECT_THAT(text_of({"instance", "list", "world"}), HasSubstr("no instances"));
  EXPECT_EQ(json_of({"mesh", "delete", "city"}), Json({{"deleted", "city"}}));
  EXPECT_EQ(run({"instance", "remove", "world", "--id", "101"}).code, cli::ExitCode::kNotFound);
  EXPECT_EQ(run({"instance", "remove", "world"}).code, cli::ExitCode::kUsage);
}

TEST_F(SceneFilesTest, ADumpHasTheColumnsOfInsert) {
  fill_world();
  const Json dump = json_of({"dump", "world"});
  EXPECT_EQ(dump["scene"], "world");
  EXPECT_EQ(dump["revision"], 6);
  const Json& things = dump["things"];
  ASSERT_EQ(things.size(), 6u);
  EXPECT_EQ(things[0].dump(),
            R"({"kind":"object","id":"7","shape":"ball","at":[1.0,2.0,3.0],"rotation":[0.0,0.0,0.0,1.0],"radius":0.5,)"
            R"("layers":1,"group":"3","tag":"42"})");
  EXPECT_EQ(things[1]["at"], Json({0.1, 0, 0}));
  EXPECT_EQ(things[1]["layers"], 6);
  EXPECT_EQ(things[2]["half"], Json({1, 1, 2}));
  EXPECT_EQ(things[3]["axis"], Json({0, 0.5, 0}));
  EXPECT_EQ(things[3]["radius"], 0.25);
  EXPECT_EQ(things[5].dump(),
            R"({"kind":"instance","id":"101","mesh":"city","at":[500.0,0.0,0.0],"rotation":[0.0,0.0,0.0,1.0],)"
            R"("scale":1.0,"layers":1,"group":"0","tag":"0"})");
}

TEST_F(SceneFilesTest, ADumpCanSelectObjectsInstancesOrAnEarlierRevision) {
  fill_world();
  const Json objects = json_of({"dump", "world", "--objects"})["things"];
  ASSERT_EQ(objects.size(), 4u);
  EXPECT_EQ(objects[0].begin().key(), "id") << "rows of one kind need not name it";
  EXPECT_EQ(json_of({"dump", "world", "--instances"})["things"].size(), 2u);
  EXPECT_EQ(json_of({"dump", "world", "--exactly", "3"})["things"].size(), 3u);
  EXPECT_EQ(json_of({"dump", "world", "--at-least", "6"})["things"].size(), 6u);
  EXPECT_EQ(run({"dump", "world", "--at-least", "1", "--exactly", "2"}).code, cli::ExitCode::kUsage);
  EXPECT_EQ(run({"dump", "nowhere"}).code, cli::ExitCode::kNotFound);
  EXPECT_EQ(run({"dump", "world", "--exactly", "99"}).code, cli::ExitCode::kFailed);
}

TEST_F(SceneFilesTest, ADumpPrintsInEveryFormat) {
  EXPECT_THAT(text_of({"dump", "world"}), HasSubstr("an empty scene"));
  EXPECT_EQ(text_of({"-o", "ndjson", "dump", "world"}), "");
  fill_world();
  const std::string lines = text_of({"-o", "ndjson", "dump", "world"});
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 6);
  EXPECT_THAT(text_of({"dump", "world"}), HasSubstr("kind      id   shape"));
  EXPECT_THAT(text_of({"-o", "csv", "dump", "world"}), HasSubstr("kind,id,shape,mesh,at.x,at.y,at.z,rotation.x"));
}

TEST_F(SceneFilesTest, DumpedObjectsCanBeInsertedElsewhere) {
  fill_world();
  ASSERT_TRUE(create("copy").ok());
  for (const std::string format : {"ndjson", "csv"}) {
    const std::string rows = path_ + "." + format;
    std::ofstream(rows) << text_of({"-o", format, "dump", "world", "--objects"});
    text_of({"insert", "copy", "mixed", "--from-" + format, rows, "--upsert"});
    unlink(rows.c_str());
    EXPECT_EQ(json_of({"dump", "copy", "--objects"})["things"], json_of({"dump", "world", "--objects"})["things"]);
    text_of({"remove", "copy", "--all"});
  }
}

TEST_F(SceneFilesTest, ManyObjectsAreDumpedInOrder) {
  constexpr uint64_t kObjects = 40'000;
  ASSERT_TRUE(apply(insert_balls(1, kObjects)).ok());
  std::istringstream lines(text_of({"-o", "ndjson", "dump", "world"}));
  uint64_t next = 1;
  for (std::string line; std::getline(lines, line); ++next)
    ASSERT_THAT(line, HasSubstr("\"id\":\"" + std::to_string(next) + "\""));
  EXPECT_EQ(next, kObjects + 1);
}

TEST_F(SceneFilesTest, MeshesAreListedShownDownloadedAndDeleted) {
  fill_world();
  const Json meshes = json_of({"mesh", "list"})["meshes"];
  ASSERT_EQ(meshes.size(), 1u);
  EXPECT_EQ(meshes[0]["name"], "city");
  EXPECT_EQ(meshes[0]["triangles"], 600);
  EXPECT_EQ(meshes[0]["vertices"], 400);
  EXPECT_EQ(meshes[0]["uses"], 2);
  const Json shown = json_of({"mesh", "show", "city"});
  EXPECT_EQ(shown["sha256"].get<std::string>().size(), 64u);
  EXPECT_EQ(shown["parts"][1]["part"], "buildings");
  EXPECT_EQ(shown["parts"][1]["triangles"], 588);
  const std::string obj = path_ + ".obj";
  EXPECT_EQ(json_of({"mesh", "download", "city", "--out", obj})["triangles"], 600);
  EXPECT_EQ(cli::import_file(obj, {})->meshes[0].indices.size(), 1800u);
  unlink(obj.c_str());
  EXPECT_EQ(run({"mesh", "delete", "city"}).code, cli::ExitCode::kFailed) << "it is in use";
  text_of({"scene", "delete", "world"});
  EXPECT_EQ(json_of({"mesh", "delete", "city"})["deleted"], "city");
  EXPECT_EQ(run({"mesh", "delete", "city"}).code, cli::ExitCode::kNotFound);
  EXPECT_EQ(run({"mesh", "show", "city"}).code, cli::ExitCode::kNotFound);
  EXPECT_EQ(run({"mesh", "download", "city", "--out", obj}).code, cli::ExitCode::kNotFound);
  EXPECT_EQ(run({"mesh", "list"}).out, "no meshes\n");
}

TEST_F(SceneFilesTest, AnExportHasTheMeshOnceAndEveryInstanceInItsPlace) {
  fill_world();
  const Json answer = json_of({"export", "world", path_});
  EXPECT_EQ(answer["things"], 6);
  EXPECT_EQ(answer["meshes"], 1);
  EXPECT_EQ(answer["triangles"], 600);
  EXPECT_EQ(answer["revision"], 6);
  const cli::testing::GlbFile file = cli::testing::read_glb(path_);
  cli::testing::expect_valid(file);
  EXPECT_EQ(file.node("instance 101 (city)")["translation"], Json({500, 0, 0}));
  EXPECT_EQ(file.node("object 7")["extras"]["tag"], "42");
  const absl::StatusOr<cli::ImportedLevel> level = cli::import_file(path_, {});
  ASSERT_TRUE(level.ok()) << level.status();
  size_t shapes = 0;
  for (size_t mesh = 0; mesh < file.json["meshes"].size(); ++mesh) {
    if (file.json["meshes"][mesh]["name"] == "city") {
      EXPECT_EQ(file.triangles(mesh), 600u);
      EXPECT_EQ(file.json["meshes"][mesh]["primitives"].size(), 2u);
    } else {
      shapes += file.triangles(mesh) * (file.json["meshes"][mesh]["name"] == "capsule end" ? 2 : 1);
    }
  }
  EXPECT_EQ(level->meshes[0].indices.size() / 3, 2 * 600 + shapes);
}

TEST_F(SceneFilesTest, AnExportedLevelImportedAgainAnswersTheSame) {
  fill_world();
  text_of({"export", "world", path_, "--instances", "--up", "y"});
  const absl::StatusOr<cli::ImportedLevel> level = cli::import_file(path_, {});
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_EQ(level->meshes[0].indices.size() / 3, 1200u);
  text_of({"import", path_, "--scene", "again", "--create"});
  const std::vector<std::string> ray = {"--from", "500,3,900", "--dir", "0.01,0.02,-1", "--columns", "t,normal"};
  std::vector<std::string> before = {"query", "ray", "world", "--source", "static"};
  std::vector<std::string> after = {"query", "ray", "again"};
  before.insert(before.end(), ray.begin(), ray.end());
  after.insert(after.end(), ray.begin(), ray.end());
  const Json there = json_of(before);
  const Json here = json_of(after);
  ASSERT_EQ(there["hits"].size(), 1u);
  ASSERT_TRUE(there["hits"][0]["t"].is_number());
  EXPECT_NEAR(there["hits"][0]["t"].get<double>(), here["hits"][0]["t"].get<double>(), 1e-3);
  EXPECT_EQ(there["hits"][0]["normal"], here["hits"][0]["normal"]);
}

// Returns the matrix of the root of the exported scene; null if the root has none.
Json root_matrix(const std::string& path) {
  const cli::testing::GlbFile file = cli::testing::read_glb(path);
  const Json& scene = file.json["scenes"][0];
  const Json& root = file.json["nodes"][scene["nodes"][0].get<size_t>()];
  return root.contains("matrix") ? root["matrix"] : Json();
}

TEST_F(SceneFilesTest, ImportLabelsASceneWithItsUpwardAxisAndExportUsesIt) {
  fill_world();
  text_of({"export", "world", path_});
  EXPECT_FALSE(root_matrix(path_).is_null()) << "without a label, z is up";
  text_of({"export", "world", path_, "--up", "y"});
  EXPECT_TRUE(root_matrix(path_).is_null()) << "the option wins";
  text_of({"import", path_, "--scene", "gltf", "--create"});
  EXPECT_EQ(json_of({"scene", "describe", "gltf"})["labels"]["up"], "y");
  text_of({"export", "gltf", path_});
  EXPECT_TRUE(root_matrix(path_).is_null());
  text_of({"export", "gltf", path_, "--up", "z"});
  EXPECT_FALSE(root_matrix(path_).is_null());
  text_of({"generate", "city", "--triangles", "600", "--scene", "made", "--create"});
  EXPECT_EQ(json_of({"scene", "describe", "made"})["labels"]["up"], "z");
  const std::string obj = path_ + ".obj";
  text_of({"generate", "blob", "--triangles", "600", "--out", obj});
  text_of({"import", obj, "--scene", "flat", "--create"});
  EXPECT_EQ(json_of({"scene", "describe", "flat"})["labels"]["up"], "z");
  text_of({"import", obj, "--scene", "tall", "--create", "--up", "y", "--mesh", "tall"});
  EXPECT_EQ(json_of({"scene", "describe", "tall"})["labels"]["up"], "y");
  EXPECT_THAT(run({"import", obj, "--scene", "tall", "--mesh", "other"}).err, HasSubstr("note: z is up in this level"));
  unlink(obj.c_str());
}

TEST_F(SceneFilesTest, APictureUsesTheUpwardAxisOfItsScene) {
  const std::string png = path_ + ".png";
  const auto eye = [&](const std::vector<std::string>& more) {
    std::vector<std::string> line = {"render", "tall", png, "--size", "32x24"};
    line.insert(line.end(), more.begin(), more.end());
    return json_of(line)["eye"];
  };
  for (const char* const axis : {"y", "z"}) {
    text_of({"scene", "create", "tall", "--label", std::string("up=") + axis});
    text_of({"insert", "tall", "ball", "--id", "1", "--at", "0,0,0", "--radius", "1"});
    const size_t up = axis[0] == 'y' ? 1 : 2;
    EXPECT_GT(eye({})[up].get<double>(), 1) << "seen from above";
    EXPECT_GT(eye({"--up", "1,0,0"})[0].get<double>(), 1) << "the option wins";
    EXPECT_GT(eye({"--dir", up == 1 ? "0,-1,0" : "0,0,-1"})[up].get<double>(), 1) << "a plan needs no --up";
    text_of({"scene", "delete", "tall"});
  }
  unlink(png.c_str());
}

TEST_F(SceneFilesTest, AFarSceneIsTranslatedAndTheOffsetReported) {
  text_of({"insert", "world", "ball", "--id", "1", "--at", "123456789.125,0,0", "--radius", "0.5"});
  const Outcome outcome = run({"-o", "json", "export", "world", path_});
  EXPECT_EQ(Json::parse(outcome.out)["recentre"], Json({123456789.0, 0, 0}));
  EXPECT_THAT(outcome.err, HasSubstr("note: the file's coordinates are 32-bit floats"));
  EXPECT_EQ(cli::testing::read_glb(path_).node("object 1")["translation"][0], 0.125);
}

TEST_F(SceneFilesTest, ExportErrorsNameTheSceneTheEndingOrThePath) {
  const Outcome empty = run({"export", "world", path_});
  EXPECT_EQ(empty.code, cli::ExitCode::kFailed);
  EXPECT_THAT(empty.err, HasSubstr("scene world has nothing to export"));
  fill_world();
  EXPECT_EQ(run({"export", "nowhere", path_}).code, cli::ExitCode::kNotFound);
  const Outcome ending = run({"export", "world", "/tmp/world.fbx"});
  EXPECT_EQ(ending.code, cli::ExitCode::kUsage);
  EXPECT_THAT(ending.err, HasSubstr("give a path that ends in .glb"));
  const Outcome path = run({"export", "world", "/nonexistent/out.glb"});
  EXPECT_EQ(path.code, cli::ExitCode::kFailed);
  EXPECT_THAT(path.err, HasSubstr("cannot write /nonexistent/out.glb: check its folder and space"));
}

TEST_F(SceneFilesTest, GeneratedTerrainAndBlobAreHitFromInsideAndAbove) {
  text_of({"generate", "terrain", "--triangles", "5000", "--scene", "world", "--at", "0,0,-200"});
  text_of({"generate", "blob", "--triangles", "5000", "--scene", "world"});
  for (const char* direction : {"1,0,0", "0,1,0", "0,0,1", "-1,-1,-1", "1,2,-3"})
    EXPECT_THAT(text_of({"query", "ray", "world", "--from", "0,0,0", "--dir", direction}), HasSubstr("yes"));
  EXPECT_THAT(text_of({"query", "ray", "world", "--from", "20,20,0", "--dir", "0,0,-1"}), HasSubstr("yes"));
  EXPECT_EQ(run({"generate", "blob", "--triangles", "7", "--scene", "world"}).code, cli::ExitCode::kUsage);
  EXPECT_EQ(run({"generate", "terrain", "--triangles", "999999999", "--scene", "world"}).code, cli::ExitCode::kUsage);
}

}  // namespace
}  // namespace locus::test
