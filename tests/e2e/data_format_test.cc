// Data directories of every format that was ever shipped stay readable: tests/golden/data/ has a sample of each format,
// written by a daemon that was killed, and a text with the sample's contents.
//
// If LOCUS_WRITE_SAMPLE=FOLDER is set, the second test writes a sample into FOLDER. The first commit of a new format
// adds a sample.
#include <google/protobuf/text_format.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "tests/support/kept_daemon.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using ::testing::HasSubstr;

constexpr uint64_t kWriter = 7;
constexpr uint64_t kBatches = 3;  // number of batches that have a writer id

class DataFormatTest : public ::testing::Test {
 protected:
  static std::filesystem::path samples() { return LOCUS_SOURCE_DIR "/tests/golden/data"; }

  template <class Service, class Request, class Response>
  Response call(Service& stub, grpc::Status (Service::*method)(grpc::ClientContext*, const Request&, Response*),
                const Request& request) {
    grpc::ClientContext context;
    set_timeout(context);
    Response response;
    const grpc::Status status = (stub.*method)(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  }

  // Applies a batch given in protobuf's text format.
  v1::UpdateAck apply(const std::string& scene, const std::string& batch) {
    v1::ApplyUpdatesRequest request;
    request.set_scene(scene);
    EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(batch, request.mutable_batch())) << batch;
    return call(*daemon_.stubs().updates, &v1::UpdateService::Stub::ApplyUpdates, request).ack();
  }

  // Applies batches given in protobuf's text format as the messages of one revision.
  void apply_together(const std::string& scene, const std::vector<std::string>& batches) {
    grpc::ClientContext context;
    set_timeout(context);
    const auto stream = daemon_.stubs().updates->StreamUpdates(&context);
    v1::StreamUpdatesRequest request;
    request.set_scene(scene);
    v1::StreamUpdatesResponse response;
    for (size_t i = 0; i < batches.size(); ++i) {
      EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(batches[i], request.mutable_batch())) << batches[i];
      request.mutable_batch()->set_continues(i + 1 < batches.size());
      EXPECT_TRUE(stream->Write(request) && stream->Read(&response));
      EXPECT_TRUE(response.has_ack()) << response.ShortDebugString();
    }
    stream->WritesDone();
    EXPECT_TRUE(stream->Finish().ok());
  }

  void upload_cube(const std::string& name, const std::string& part) {
    grpc::ClientContext context;
    set_timeout(context);
    v1::UploadMeshRequest mesh = whole_mesh(name);
    if (!part.empty()) mesh.add_parts()->set_name(part);
    v1::UploadMeshResponse uploaded;
    const auto upload = daemon_.stubs().scenes->UploadMesh(&context, &uploaded);
    ASSERT_TRUE(upload->Write(mesh));
    upload->WritesDone();
    ASSERT_TRUE(upload->Finish().ok());
  }

  void change_instances(const std::string& change) {
    v1::ChangeInstancesRequest request;
    EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(change, &request)) << change;
    call(*daemon_.stubs().scenes, &v1::SceneService::Stub::ChangeInstances, request);
  }

  void create(const std::string& name, const std::string& spec) {
    v1::SceneSpec parsed;
    EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(spec, &parsed)) << spec;
    create_scene(daemon_.stubs(), name, parsed);
  }

  // Inserts and removes so many objects that a snapshot is due, and waits until the snapshot is written.
  void make_a_snapshot_due(const std::string& scene) {
    std::string ids;
    const size_t before = written_snapshots();
    for (int id = 1000; id < 6000; ++id) absl::StrAppend(&ids, id == 1000 ? "" : ",", id);
    apply(scene, absl::StrCat("inserts { ids: [", ids, "] positions: [1, 2, 3] point {} }"));
    apply(scene, absl::StrCat("remove_ids: [", ids, "]"));
    for (int i = 0; i < 1000 && written_snapshots() == before; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_GT(written_snapshots(), before);
  }
  size_t written_snapshots() const {
    const std::string log = daemon_.log();
    const std::vector<std::string> parts = absl::StrSplit(log, "snapshot written");
    return parts.size() - 1;
  }

  // Writes one of everything that a directory can contain, some of it before and some of it after a snapshot.
  void fill() {
    upload_cube("cube", "");
    upload_cube("crate", "planks");
    create("arena", R"(labels { key: "level" value: "7" } history_ticks: 4 winding: WINDING_CLOCKWISE)");
    // The ids are those that the server chose when the samples were made.
    change_instances(R"(scene: "arena" place { mesh: "cube" ids: [9223372036854775809, 9223372036854775810]
                                               translations: [5, 0, 0, 9, 0.25, 0] layers: [1, 6] })");
    change_instances(R"(scene: "arena" place { mesh: "crate" ids: 9223372036871553025 translations: [5, 9, 0] })");
    apply("arena", R"(writer: 7 batch: 1 tick: 3
                      inserts { ids: [1, 2] positions_f64: [0.1, 2, 3, 4, 5, 6] point {} tags: [11, 12] }
                      inserts { ids: [3] positions: [1, 1, 1] ball { radii: 0.5 } groups: 9 }
                      inserts { ids: [4, 5] positions: [2, 0, 0, 3, 0, 0] box { half_extents: [1, 2, 3] }
                                rotations: [0, 0.6, 0, 0.8] layers: [2, 3] })");
    make_a_snapshot_due("arena");
    create("twin", R"(static_from: "arena" overload: OVERLOAD_POLICY_LATEST_WINS)");
    create("brief", "");
    apply("brief", "tick: 10 inserts { ids: [1, 2] positions: [1, 2, 3, 4, 5, 6] point {} expire_ticks: [50, 0] }");
    apply_together("brief", {"inserts { ids: 3 positions: [7, 8, 9] point {} expire_ticks: 2 }", "remove_ids: 77",
                             "writer: 8 batch: 1 tick: 11 moves { ids: 3 positions: [1, 1, 1] }"});
    make_a_snapshot_due("brief");
    apply_together("brief", {"inserts { ids: [4, 5] positions: [7, 8, 9] point {} expire_ticks: [2, 9] }",
                             "writer: 8 batch: 2 tick: 13 moves { ids: 2 positions: [2, 2, 2] } remove_ids: 78"});
    create("rigs", "idle_ttl_s: 31536000 mesh_grace_s: 31536000 cell_size: 3");
    apply("rigs", R"(writer: 9 batch: 1 lease_ms: 86400000 tick: 1
                     inserts { ids: [1, 2] positions: [1, 2, 3, 4, 5, 6] compound {
                       parts { positions: [0, 0, 0, 0, 1, 0] ball { radii: [0.5, 0.25] } layers: [1, 2] }
                       parts { positions: [0, 2, 0] rotations: [0, 0.6, 0, 0.8] box { half_extents: [1, 2, 3] } } } })");
    make_a_snapshot_due("rigs");
    apply("rigs", R"(writer: 9 batch: 2 tick: 2
                     moves { ids: 2 positions: [7, 8, 9] parts_each: 3 part_positions: [1, 0, 0, 1, 1, 0, 1, 2, 0] }
                     inserts { ids: 3 positions: [3, 3, 3] rotations: [0, 0.6, 0, 0.8] compound {
                       parts { positions: [0, 0, 0] capsule { radii: 0.5 half_axes: [0, 1, 0] } } } })");
    create("quick", R"(durability: DURABILITY_MEMORY)");
    create("gone", "");
    v1::DeleteSceneRequest gone;
    gone.set_name("gone");
    call(*daemon_.stubs().scenes, &v1::SceneService::Stub::DeleteScene, gone);
    change_instances(R"(scene: "arena" remove_ids: [)" + first_instance() + R"(]
                        place { mesh: "cube" ids: 9223372036938661889 translations: [0, 7, 0]
                                rotations: [0, 0, 0.6, 0.8] tags: 5 }
                        place { mesh: "crate" ids: 9223372036938661890 translations: [0, 9, 0] })");
    apply("arena", R"(writer: 7 batch: 2 tick: 4
                      moves { ids: [1, 3] positions: [1.5, 0, 0, 2.5, 0, 0] }
                      relabels { ids: 2 tags: 99 groups: 4 layers: 8 }
                      inserts { ids: [6] positions: [8, 8, 8] capsule { radii: 0.25 half_axes: [0, 1, 0] } })");
    apply("arena", R"(writer: 7 batch: 3 tick: 5 frame { x: 1000 }
                      moves { ids: 4 positions: [0.5, 0, 0] teleport: true } remove_ids: [5]
                      instance_moves { ids: 9223372036938661889 positions_f64: [0, 7, 2] rotations: [0, 0, 0, 1]
                                       scales: 2 }
                      instance_relabels { ids: 9223372036938661890 layers: 0 tags: 8 })");
    apply("twin", R"(inserts { ids: [1] positions: [1, 2, 3] ball { radii: 2 } })");
    apply("quick", R"(inserts { ids: [1, 2] positions: [1, 2, 3, 4, 5, 6] point {} })");
    v1::UpdateSceneRequest update;
    EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(
        R"(name: "twin" fields: ["cell_size", "labels"] cell_size: 0.5 labels { key: "level" value: "8" })", &update));
    call(*daemon_.stubs().scenes, &v1::SceneService::Stub::UpdateScene, update);
  }

  std::string first_instance() {
    const std::string dump = dump_of(daemon_.stubs(), "arena");
    const size_t at = dump.find("ids: ", dump.find("instances {"));
    return dump.substr(at + 5, dump.find('\n', at) - at - 5);
  }

  // Returns everything that a client can see of the directory, as text. The epochs in this text are random.
  std::string words() {
    std::string words;
    v1::ListScenesResponse scenes =
        call(*daemon_.stubs().scenes, &v1::SceneService::Stub::ListScenes, v1::ListScenesRequest());
    for (const v1::Scene& scene : scenes.scenes()) {
      absl::StrAppend(&words, "scene ", scene.name(), " revision ", scene.revision(), " tick ", scene.tick(), "\n",
                      scene.spec().DebugString(), dump_of(daemon_.stubs(), scene.name()));
    }
    const v1::ListMeshesResponse meshes =
        call(*daemon_.stubs().scenes, &v1::SceneService::Stub::ListMeshes, v1::ListMeshesRequest());
    for (const v1::Mesh& mesh : meshes.meshes()) {
      absl::StrAppend(&words, "mesh ", mesh.name(), " triangles ", mesh.triangles(), "\n");
      for (const v1::MeshPart& part : mesh.parts()) absl::StrAppend(&words, "part ", part.name(), "\n");
    }
    return words;
  }

  static std::string without_epochs(const std::string& words) {
    std::string rest;
    for (const absl::string_view line : absl::StrSplit(words, '\n'))
      if (!absl::StartsWith(line, "epoch: ")) absl::StrAppend(&rest, line, "\n");
    return rest;
  }

  // Copies a directory without RocksDB's text logs, which do not belong to a sample.
  static void copy_sample(const std::filesystem::path& from, const std::filesystem::path& to) {
    std::filesystem::create_directories(to.parent_path());
    std::filesystem::copy(from, to, std::filesystem::copy_options::recursive);
    std::vector<std::filesystem::path> logs;
    for (const auto& entry : std::filesystem::directory_iterator(to / "rocksdb"))
      if (absl::StartsWith(entry.path().filename().string(), "LOG")) logs.push_back(entry.path());
    for (const std::filesystem::path& log : logs) std::filesystem::remove(log);
  }

  // Writes an access file, so that scenes and meshes get a creator.
  static std::string access_file(const TemporaryFolder& folder) {
    const std::string file = folder.file("access");
    std::ofstream(file) << "grant anonymous read,update,admin *\ngrant anonymous meshes\n";
    std::filesystem::permissions(file, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
    return file;
  }

  const TemporaryFolder folder_;
  KeptDaemon daemon_{{"--snapshot-after", "64KiB", "--access-file", access_file(folder_)}};
};

TEST_F(DataFormatTest, EveryFormatIsRead) {
  size_t formats = 0;
  for (const auto& sample : std::filesystem::directory_iterator(samples())) {
    SCOPED_TRACE(sample.path().filename().string());
    ++formats;
    std::filesystem::remove_all(daemon_.directory());
    copy_sample(sample.path() / "data", daemon_.directory());
    EXPECT_EQ(daemon_.maintain("check"), 0) << daemon_.printed();
    daemon_.start();
    const std::string expected = text_of((sample.path() / "holds.txt").string());
    EXPECT_EQ(without_epochs(words()), without_epochs(expected));
    // Only scenes whose acks wait for the disk are compared: they lost no record, so their epochs are unchanged. The
    // scene "quick" may have lost records, and has a new epoch in this case.
    for (const char* scene : {"arena", "twin"})
      EXPECT_THAT(expected, HasSubstr(absl::StrCat("epoch: ", get_scene(daemon_.stubs(), scene).epoch(), "\n")));
    // The writer's last batch is known, and its next batch is applied.
    EXPECT_TRUE(apply("arena", absl::StrCat("writer: ", kWriter, " batch: ", kBatches)).duplicate());
    EXPECT_FALSE(apply("arena", absl::StrCat("writer: ", kWriter, " batch: ", kBatches + 1)).duplicate());
    EXPECT_EQ(daemon_.stop(), 0);
    daemon_.start();
    EXPECT_TRUE(apply("arena", absl::StrCat("writer: ", kWriter, " batch: ", kBatches + 1)).duplicate());
    EXPECT_EQ(daemon_.stop(), 0);
  }
  EXPECT_GT(formats, 0u);
}

TEST_F(DataFormatTest, TheSampleOfThisFormatHoldsWhatIsWrittenIntoANewDirectory) {
  daemon_.start();
  fill();
  const std::string holds = words();
  daemon_.kill();
  if (const char* folder = std::getenv("LOCUS_WRITE_SAMPLE"); folder != nullptr) {
    copy_sample(daemon_.directory(), std::filesystem::path(folder) / "data");
    std::ofstream(std::filesystem::path(folder) / "holds.txt") << holds;
  } else {
    EXPECT_EQ(without_epochs(holds), without_epochs(text_of((samples() / "format-6" / "holds.txt").string())));
  }
}

}  // namespace
}  // namespace locus::test
