// Members of a cluster inside the test's process, for tests of clients with several addresses. All members share one
// FakeCluster, which says who leads.
#ifndef LOCUS_TESTS_CLIENT_LIB_FAKE_MEMBER_H_
#define LOCUS_TESTS_CLIENT_LIB_FAKE_MEMBER_H_

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "locus/v1/query_service.grpc.pb.h"
#include "locus/v1/scene_service.grpc.pb.h"
#include "locus/v1/update_service.grpc.pb.h"
#include "tests/client/lib/fake_updates.h"

namespace locus::client::testing {

// State of the one scene of the cluster. Members lock the mutex.
struct FakeCluster {
  std::mutex mutex;
  std::string leader;  // address; empty = no member leads
  uint64_t token = 1;
  uint64_t epoch = 1;
  std::vector<std::string> followers;
  std::vector<uint64_t> applied;         // ticks of the applied batches
  std::map<uint64_t, uint64_t> numbers;  // highest batch number of each writer
  // Returns true for an applied batch whose call breaks instead of its ack. Called with the lock held.
  std::function<bool(const v1::UpdateBatch&)> breaks = [](const v1::UpdateBatch&) { return false; };
};

class FakeMember {
 public:
  explicit FakeMember(FakeCluster& cluster) : cluster_(cluster) {
    grpc::EnableDefaultHealthCheckService(true);
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&updates_);
    builder.RegisterService(&queries_);
    builder.RegisterService(&scenes_);
    server_ = builder.BuildAndStart();
    address_ = "127.0.0.1:" + std::to_string(port);
  }
  ~FakeMember() { stop(); }

  const std::string& address() const { return address_; }
  void stop() {
    if (server_ != nullptr) server_->Shutdown(std::chrono::system_clock::now());
    server_ = nullptr;
  }
  // Views of the queries that arrived. Call it while no call runs.
  const std::vector<v1::View>& views() const { return views_; }
  // Number of revisions that this follower is behind; set it while no call runs.
  uint64_t behind = 0;

 private:
  struct Updates final : v1::UpdateService::Service {
    explicit Updates(FakeMember& owner) : member(owner) {}
    grpc::Status ApplyUpdates(grpc::ServerContext*, const v1::ApplyUpdatesRequest* request,
                              v1::ApplyUpdatesResponse* response) override {
      v1::Error error;
      if (!member.apply(request->batch(), *response->mutable_ack(), error))
        return {grpc::StatusCode::UNAVAILABLE, "planned"};
      return error.code() == 0 ? grpc::Status::OK : status_of(error);
    }
    grpc::Status StreamUpdates(
        grpc::ServerContext*,
        grpc::ServerReaderWriter<v1::StreamUpdatesResponse, v1::StreamUpdatesRequest>* stream) override {
      v1::StreamUpdatesRequest request;
      while (stream->Read(&request)) {
        v1::StreamUpdatesResponse response;
        response.set_sequence(request.sequence());
        v1::Error error;
        v1::UpdateAck ack;
        if (!member.apply(request.batch(), ack, error)) return {grpc::StatusCode::UNAVAILABLE, "planned"};
        if (error.code() == 0)
          *response.mutable_ack() = ack;
        else
          *response.mutable_error() = error;
        if (!stream->Write(response)) break;
      }
      return grpc::Status::OK;
    }
    FakeMember& member;
  };
  struct Queries final : v1::QueryService::Service {
    explicit Queries(FakeMember& owner) : member(owner) {}
    grpc::Status Query(grpc::ServerContext*, const v1::QueryRequest* request, v1::QueryResponse* response) override {
      const v1::Error error = member.answer(request->batch().view(), *response->mutable_result());
      return error.code() == 0 ? grpc::Status::OK : status_of(error);
    }
    grpc::Status StreamQueries(
        grpc::ServerContext*,
        grpc::ServerReaderWriter<v1::StreamQueriesResponse, v1::StreamQueriesRequest>* stream) override {
      v1::StreamQueriesRequest request;
      while (stream->Read(&request)) {
        v1::StreamQueriesResponse response;
        response.set_sequence(request.sequence());
        v1::QueryResult result;
        const v1::Error error = member.answer(request.batch().view(), result);
        if (error.code() == 0)
          *response.mutable_result() = result;
        else
          *response.mutable_error() = error;
        if (!stream->Write(response)) break;
      }
      return grpc::Status::OK;
    }
    FakeMember& member;
  };
  struct Scenes final : v1::SceneService::Service {
    explicit Scenes(FakeMember& owner) : member(owner) {}
    grpc::Status GetScene(grpc::ServerContext*, const v1::GetSceneRequest*, v1::GetSceneResponse* response) override {
      const std::lock_guard lock(member.cluster_.mutex);
      if (const std::optional<v1::Error> error = member.refused(nullptr)) return status_of(*error);
      v1::ScenePlacement& placement = *response->mutable_scene()->mutable_placement();
      placement.set_leader(member.cluster_.leader);
      for (const std::string& follower : member.cluster_.followers) placement.add_followers()->set_address(follower);
      return grpc::Status::OK;
    }
    FakeMember& member;
  };

  static grpc::Status status_of(const v1::Error& error) {
    if (error.reason() == v1::REASON_UNSPECIFIED) return {static_cast<grpc::StatusCode>(error.code()), error.message()};
    return refusal(static_cast<grpc::StatusCode>(error.code()), error.message(), error);
  }
  static v1::Error error_with(grpc::StatusCode code, v1::Reason reason, const std::string& message) {
    v1::Error error;
    error.set_code(code);
    error.set_reason(reason);
    error.set_message(message);
    return error;
  }

  // Returns the error of a request that this member does not answer. `view`: null for requests to the leader.
  // Precondition: the cluster is locked.
  std::optional<v1::Error> refused(const v1::View* view) const {
    if (cluster_.leader == address_) return std::nullopt;
    for (const std::string& follower : cluster_.followers)
      if (view != nullptr && !view->leader_only() && follower == address_) return std::nullopt;
    if (cluster_.leader.empty()) {
      v1::Error error = error_with(grpc::StatusCode::UNAVAILABLE, v1::REASON_NO_LEADER, "no server leads the scene");
      error.set_retry_after_ms(20);
      return error;
    }
    v1::Error error =
        error_with(grpc::StatusCode::FAILED_PRECONDITION, v1::REASON_ELSEWHERE, "another server has the scene");
    error.add_addresses(cluster_.leader);
    error.set_token(cluster_.token);
    return error;
  }

  // Fills in the ack or the error of an update. Returns false if the call breaks.
  bool apply(const v1::UpdateBatch& batch, v1::UpdateAck& ack, v1::Error& error) {
    const std::lock_guard lock(cluster_.mutex);
    if (const std::optional<v1::Error> refusal = refused(nullptr)) {
      error = *refusal;
      return true;
    }
    const uint64_t expected = cluster_.numbers[batch.writer()] + 1;
    if (batch.batch() > expected) {
      error = error_with(grpc::StatusCode::FAILED_PRECONDITION, v1::REASON_BATCH_GAP, "a gap");
      error.set_limit_value(static_cast<double>(expected));
      return true;
    }
    ack.set_duplicate(batch.batch() != 0 && batch.batch() < expected);
    if (!ack.duplicate()) {
      cluster_.applied.push_back(batch.tick());
      if (batch.batch() != 0) cluster_.numbers[batch.writer()] = batch.batch();
    }
    ack.set_epoch(cluster_.epoch);
    ack.set_revision(cluster_.applied.size());
    return !cluster_.breaks(batch);
  }

  v1::Error answer(const v1::View& view, v1::QueryResult& result) {
    const std::lock_guard lock(cluster_.mutex);
    views_.push_back(view);
    if (const std::optional<v1::Error> error = refused(&view)) return *error;
    const uint64_t revision = cluster_.applied.size() - behind;
    if (view.epoch() != 0 && view.epoch() != cluster_.epoch)
      return error_with(grpc::StatusCode::FAILED_PRECONDITION, v1::REASON_SCENE_RESTARTED, "another epoch");
    if (view.at_least() > revision)
      return error_with(grpc::StatusCode::DEADLINE_EXCEEDED, v1::REASON_UNSPECIFIED, "not reached");
    result.set_epoch(cluster_.epoch);
    result.set_revision(view.exactly() != 0 ? view.exactly() : revision);
    return {};
  }

  FakeCluster& cluster_;
  std::string address_;
  std::vector<v1::View> views_;
  Updates updates_{*this};
  Queries queries_{*this};
  Scenes scenes_{*this};
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace locus::client::testing

#endif  // LOCUS_TESTS_CLIENT_LIB_FAKE_MEMBER_H_
