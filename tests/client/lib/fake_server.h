// Fake server of the real protocol inside the test's process, with configurable failures. Used by tests of the client
// library and of the command line. Handlers run on gRPC's threads, so tests configure failures before the first call,
// or by members that lock a mutex.
#ifndef LOCUS_TESTS_CLIENT_LIB_FAKE_SERVER_H_
#define LOCUS_TESTS_CLIENT_LIB_FAKE_SERVER_H_

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "client/lib/call_gate.h"
#include "client/lib/client.h"
#include "client/lib/sha256.h"
#include "locus/v1/query_service.grpc.pb.h"
#include "locus/v1/scene_service.grpc.pb.h"
#include "locus/v1/server_service.grpc.pb.h"
#include "locus/v1/update_service.grpc.pb.h"
#include "tests/client/lib/fake_updates.h"

namespace locus::client::testing {

// Fake QueryService: answers each Query call with the result of `answer`. The updates of steps go to `updates`.
class FakeQueries final : public v1::QueryService::Service {
 public:
  explicit FakeQueries(FakeUpdates& updates) : updates_(updates) {}

  // Answers at the revision of the ack. Queries with max_work = kRefusedWork fail after the update was applied.
  grpc::Status Step(grpc::ServerContext* context, const v1::StepRequest* request, v1::StepResponse* response) override {
    v1::ApplyUpdatesRequest update;
    *update.mutable_batch() = request->update();
    v1::ApplyUpdatesResponse applied;
    if (const grpc::Status status = updates_.ApplyUpdates(context, &update, &applied); !status.ok()) return status;
    *response->mutable_ack() = applied.ack();
    if (request->queries().max_work() == kRefusedWork)
      set_refused(*response->mutable_error());
    else
      response->mutable_result()->set_revision(applied.ack().revision());
    return grpc::Status::OK;
  }

  grpc::Status Query(grpc::ServerContext* context, const v1::QueryRequest* request,
                     v1::QueryResponse* response) override {
    std::this_thread::sleep_for(delay);
    std::lock_guard lock(mutex_);
    ++calls;
    scene = metadata_of(*context, "x-scene");
    last_batch = request->batch();
    if (failing_calls > 0) {
      --failing_calls;
      return failure;
    }
    return answer(*request, *response->mutable_result());
  }

  // Answers a step immediately. Delays the answers of each pair of messages until both have arrived, then sends them in
  // reverse order. If the member `stream_answer` is set, answers each message immediately instead, with the result of
  // `stream_answer`.
  grpc::Status StreamQueries(
      grpc::ServerContext*,
      grpc::ServerReaderWriter<v1::StreamQueriesResponse, v1::StreamQueriesRequest>* stream) override {
    v1::StreamQueriesRequest request;
    std::vector<v1::StreamQueriesResponse> held;
    int messages = 0;
    while (stream->Read(&request)) {
      v1::StreamQueriesResponse response;
      response.set_sequence(request.sequence());
      ++messages;
      if (request.has_update()) {
        const std::optional<v1::StreamUpdatesResponse> applied = updates_.apply_step(request.update(), messages);
        if (!applied) return updates_.breaks.status;
        if (applied->has_error())
          *response.mutable_error() = applied->error();
        else
          *response.mutable_ack() = applied->ack();
        if (applied->has_ack() && request.batch().max_work() == kRefusedWork)
          set_refused(*response.mutable_error());
        else if (applied->has_ack())
          response.mutable_result()->set_revision(applied->ack().revision());
        stream->Write(response);
        continue;
      }
      {
        std::lock_guard lock(mutex_);
        ++calls;
        if (failing_calls > 0 && calls > 1) {
          --failing_calls;
          return failure;
        }
        if (silent_messages > 0) {
          --silent_messages;
          continue;
        }
        if (stream_answer) *response.mutable_result() = stream_answer(request.batch());
      }
      if (response.has_result()) {
        stream->Write(response);
        continue;
      }
      if (request.batch().max_work() == kRefusedWork) {
        set_refused(*response.mutable_error());
      } else {
        response.mutable_result()->set_revision(request.batch().max_work());
      }
      held.push_back(response);
      if (held.size() < 2) continue;
      stream->Write(held[1]);
      stream->Write(held[0]);
      held.clear();
    }
    for (const v1::StreamQueriesResponse& response : held) stream->Write(response);
    return grpc::Status::OK;
  }

  static constexpr uint64_t kRefusedWork = 666;

  std::function<grpc::Status(const v1::QueryRequest&, v1::QueryResult&)> answer = [](const v1::QueryRequest&,
                                                                                     v1::QueryResult& result) {
    result.set_revision(1);
    return grpc::Status::OK;
  };
  std::function<v1::QueryResult(const v1::QueryBatch&)> stream_answer;
  int silent_messages = 0;             // number of the next stream messages that get no answer
  std::chrono::milliseconds delay{0};  // of Query(), before it answers
  int failing_calls = 0;
  grpc::Status failure{grpc::StatusCode::UNAVAILABLE, "planned"};
  int calls = 0;
  std::string scene;
  v1::QueryBatch last_batch;

 private:
  static void set_refused(v1::Error& error) {
    error.set_code(grpc::StatusCode::INVALID_ARGUMENT);
    error.set_reason(v1::REASON_NOT_FINITE);
  }

  std::mutex mutex_;
  FakeUpdates& updates_;
};

// Fake SceneService: stores scenes by name, the hashes of all uploaded meshes, and the arrays of the last mesh.
class FakeScenes final : public v1::SceneService::Service {
 public:
  grpc::Status CreateScene(grpc::ServerContext*, const v1::CreateSceneRequest* request,
                           v1::CreateSceneResponse* response) override {
    std::lock_guard lock(mutex_);
    ++creates;
    if (failing_creates > 0) {
      --failing_creates;
      return {grpc::StatusCode::UNAVAILABLE, "planned"};
    }
    v1::Scene& scene = scenes[request->name()];
    if (!scene.name().empty() && !request->if_absent()) {
      return refusal(grpc::StatusCode::ALREADY_EXISTS, "there is a scene of that name", {});
    }
    scene.set_name(request->name());
    *scene.mutable_spec() = request->spec();
    scene.set_state(v1::SCENE_STATE_READY);
    scene.set_epoch(uint64_t{1} << 63);
    *response->mutable_scene() = scene;
    return grpc::Status::OK;
  }

  grpc::Status GetScene(grpc::ServerContext*, const v1::GetSceneRequest* request,
                        v1::GetSceneResponse* response) override {
    std::lock_guard lock(mutex_);
    const auto found = scenes.find(request->name());
    if (found == scenes.end()) return missing(request->name());
    *response->mutable_scene() = found->second;
    return grpc::Status::OK;
  }

  // Returns the scenes in pages of two scenes.
  grpc::Status ListScenes(grpc::ServerContext*, const v1::ListScenesRequest* request,
                          v1::ListScenesResponse* response) override {
    std::lock_guard lock(mutex_);
    auto scene = scenes.upper_bound(request->page_token());
    for (; scene != scenes.end() && response->scenes_size() < 2; ++scene) *response->add_scenes() = scene->second;
    if (scene != scenes.end()) response->set_next_page_token(response->scenes().rbegin()->name());
    return grpc::Status::OK;
  }

  grpc::Status DeleteScene(grpc::ServerContext*, const v1::DeleteSceneRequest* request,
                           v1::DeleteSceneResponse*) override {
    std::lock_guard lock(mutex_);
    if (denied) return {grpc::StatusCode::PERMISSION_DENIED, "planned"};
    if (scenes.erase(request->name()) == 0 && !request->if_present()) return missing(request->name());
    return grpc::Status::OK;
  }

  grpc::Status UploadMesh(grpc::ServerContext*, grpc::ServerReader<v1::UploadMeshRequest>* reader,
                          v1::UploadMeshResponse* response) override {
    v1::UploadMeshRequest first;
    if (!reader->Read(&first)) return {grpc::StatusCode::INVALID_ARGUMENT, "nothing came"};
    std::lock_guard lock(mutex_);
    response->mutable_mesh()->set_name(first.mesh());
    response->mutable_mesh()->set_sha256(first.sha256());
    response->mutable_mesh()->set_triangles(first.triangle_count());
    if (known_hashes.count(first.sha256()) > 0) {
      response->set_already_known(true);
      return grpc::Status::OK;
    }
    v1::UploadMeshRequest message;
    vertices.clear();
    indices.clear();
    largest_message = first.ByteSizeLong();
    while (reader->Read(&message)) {
      largest_message = std::max(largest_message, message.ByteSizeLong());
      vertices.insert(vertices.end(), message.vertices().begin(), message.vertices().end());
      indices.insert(indices.end(), message.indices().begin(), message.indices().end());
    }
    known_hashes.insert(first.sha256());
    return grpc::Status::OK;
  }

  // Sends the messages in `mesh_pieces`, whatever was uploaded before.
  grpc::Status DownloadMesh(grpc::ServerContext*, const v1::DownloadMeshRequest* request,
                            grpc::ServerWriter<v1::DownloadMeshResponse>* writer) override {
    std::lock_guard lock(mutex_);
    if (no_mesh) return missing(request->mesh());
    for (size_t i = 0; i < mesh_pieces.size(); ++i) {
      if (i == 1 && failing_downloads > 0) {
        --failing_downloads;
        return {grpc::StatusCode::UNAVAILABLE, "planned"};
      }
      writer->Write(mesh_pieces[i]);
    }
    return grpc::Status::OK;
  }

  grpc::Status ChangeInstances(grpc::ServerContext*, const v1::ChangeInstancesRequest* request,
                               v1::ChangeInstancesResponse* response) override {
    std::lock_guard lock(mutex_);
    last_change = *request;
    for (int i = 0; i < request->place_size(); ++i) response->add_ids((uint64_t{1} << 63) + static_cast<uint64_t>(i));
    response->set_revision(1);
    return grpc::Status::OK;
  }

  grpc::Status DumpScene(grpc::ServerContext*, const v1::DumpSceneRequest*,
                         grpc::ServerWriter<v1::DumpSceneResponse>* writer) override {
    v1::DumpSceneResponse piece;
    for (uint64_t revision = 1; revision <= 3; ++revision) {
      piece.set_revision(revision);
      writer->Write(piece);
    }
    return grpc::Status::OK;
  }

  // Replaces the scene of the same name; may be called while the server handles calls.
  void replace(const v1::Scene& scene) {
    std::lock_guard lock(mutex_);
    scenes[scene.name()] = scene;
  }

  static grpc::Status missing(const std::string& name) {
    v1::Error error;
    error.set_reason(v1::REASON_NOT_FOUND);
    error.set_field("name");
    return refusal(grpc::StatusCode::NOT_FOUND, "no scene is named " + name, error);
  }

  std::map<std::string, v1::Scene> scenes;
  std::set<std::string> known_hashes;
  std::vector<float> vertices;
  std::vector<uint32_t> indices;
  size_t largest_message = 0;
  std::vector<v1::DownloadMeshResponse> mesh_pieces;
  int failing_downloads = 0;  // number of the next downloads that fail after their first message
  bool no_mesh = false;
  v1::ChangeInstancesRequest last_change;
  int creates = 0;
  int failing_creates = 0;
  bool denied = false;

 private:
  std::mutex mutex_;
};

class FakeServerService final : public v1::ServerService::Service {
 public:
  grpc::Status GetServer(grpc::ServerContext*, const v1::GetServerRequest*, v1::GetServerResponse* response) override {
    response->set_version("1.2.3");
    response->set_instruction_set("scalar");
    response->add_features("rays");
    v1::Limit& limit = *response->add_limits();
    limit.set_name("max_scenes");
    limit.set_value(1024);
    limit.set_used(2);
    limit.set_refused(3);
    if (cluster) *response->mutable_cluster() = *cluster;
    return grpc::Status::OK;
  }

  // Returns the requested entries in pages of one entry.
  grpc::Status GetQuotas(grpc::ServerContext*, const v1::GetQuotasRequest* request,
                         v1::GetQuotasResponse* response) override {
    const bool second = request->page_token() == "token:a";
    v1::IdentityQuotas& entry = *response->add_identities();
    entry.set_identity(!request->identity().empty() ? request->identity() : second ? "token:b" : "token:a");
    v1::QuotaUse& scenes = *entry.add_quotas();
    scenes.set_name("scenes");
    scenes.set_limit(8);
    scenes.set_used(3);
    scenes.set_available(5);
    v1::QuotaUse& objects = *entry.add_quotas();
    objects.set_name("objects");
    objects.set_used(1000000);
    if (request->all() && !second) response->set_next_page_token("token:a");
    return grpc::Status::OK;
  }

  // Sends the messages in `backup_pieces`, then the status `backup_end`.
  grpc::Status Backup(grpc::ServerContext*, const v1::BackupRequest*,
                      grpc::ServerWriter<v1::BackupResponse>* writer) override {
    // Copies the messages, because a test that has cancelled a backup configures the next backup while this call still
    // runs.
    const std::vector<v1::BackupResponse> pieces = backup_pieces;
    for (const v1::BackupResponse& piece : pieces) {
      if (!writer->Write(piece)) break;
    }
    return backup_end;
  }

  // Configures a backup of `files` (bytes by path). Each file is one message, as the server sends files below 1 MiB.
  void plan_backup(const std::map<std::string, std::string>& files) {
    backup_pieces.assign(1, {});
    v1::BackupSize& announced = *backup_pieces[0].mutable_announced();
    announced.set_files(static_cast<uint32_t>(files.size()));
    for (const auto& [path, bytes] : files) {
      announced.set_bytes(announced.bytes() + bytes.size());
      v1::BackupResponse piece;
      piece.set_path(path);
      piece.set_data(bytes);
      Sha256Hasher hasher;
      hasher.add(bytes);
      const Sha256 hash = hasher.finish();
      piece.mutable_end()->set_bytes(bytes.size());
      piece.mutable_end()->set_sha256(hash.data(), hash.size());
      backup_pieces.push_back(piece);
    }
  }

  std::vector<v1::BackupResponse> backup_pieces;
  grpc::Status backup_end;
  std::optional<v1::Cluster> cluster;  // nullopt: the server belongs to none
};

// Ways of a client to a fake server. Tests of the library run over both.
enum class Way { kLoopback, kInProcess };
inline const auto kBothWays = ::testing::Values(Way::kLoopback, Way::kInProcess);
inline std::string way_name(const ::testing::TestParamInfo<Way>& info) {
  return info.param == Way::kLoopback ? "Loopback" : "InProcess";
}

// Fake server with all services on a free loopback port.
class FakeServer {
 public:
  FakeServer() {
    grpc::EnableDefaultHealthCheckService(true);
    start("127.0.0.1:0");
  }
  ~FakeServer() { stop(); }

  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

  absl::StatusOr<std::unique_ptr<Client>> connect(Way way, const ClientOptions& options = {}) const {
    if (way == Way::kLoopback) return Client::connect(address(), options);
    return Client::in_process(server_->InProcessChannel({}), gate_, options);
  }

  void stop() {
    gate_->close();
    if (server_) server_->Shutdown(std::chrono::system_clock::now());
    server_.reset();
  }
  // Restarts the server on the same port, with the same state. Clients in this process cannot reach it again.
  void restart() { start(address()); }

  FakeUpdates updates;
  FakeQueries queries{updates};
  FakeScenes scenes;
  FakeServerService servers;

 private:
  void start(const std::string& address) {
    grpc::ServerBuilder builder;
    builder.AddListeningPort(address, grpc::InsecureServerCredentials(), &port_);
    builder.RegisterService(&updates);
    builder.RegisterService(&queries);
    builder.RegisterService(&scenes);
    builder.RegisterService(&servers);
    server_ = builder.BuildAndStart();
  }

  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;
  const std::shared_ptr<CallGate> gate_ = std::make_shared<CallGate>();
};

}  // namespace locus::client::testing

#endif  // LOCUS_TESTS_CLIENT_LIB_FAKE_SERVER_H_
