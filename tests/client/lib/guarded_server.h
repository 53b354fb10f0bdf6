// In-process server of the real protocol, for tests of what the client sends and how it handles refusals. The server
// requires a bearer token once require() is called, and uses TLS if the test passes credentials. Thread-safe.
#ifndef LOCUS_TESTS_CLIENT_LIB_GUARDED_SERVER_H_
#define LOCUS_TESTS_CLIENT_LIB_GUARDED_SERVER_H_

#include <grpcpp/grpcpp.h>

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "locus/v1/query_service.grpc.pb.h"
#include "locus/v1/scene_service.grpc.pb.h"
#include "locus/v1/server_service.grpc.pb.h"
#include "locus/v1/update_service.grpc.pb.h"

namespace locus::client::testing {

class GuardedServer final : v1::QueryService::Service,
                            v1::SceneService::Service,
                            v1::ServerService::Service,
                            v1::UpdateService::Service {
 public:
  // Listens on a free loopback port. Until require() is called, accepts calls with any token and calls without a token.
  explicit GuardedServer(
      const std::shared_ptr<grpc::ServerCredentials>& credentials = grpc::InsecureServerCredentials()) {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", credentials, &port_);
    builder.RegisterService(static_cast<v1::QueryService::Service*>(this));
    builder.RegisterService(static_cast<v1::SceneService::Service*>(this));
    builder.RegisterService(static_cast<v1::ServerService::Service*>(this));
    builder.RegisterService(static_cast<v1::UpdateService::Service*>(this));
    server_ = builder.BuildAndStart();
  }
  ~GuardedServer() { server_->Shutdown(std::chrono::system_clock::now()); }

  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }
  int port() const { return port_; }

  // Makes the server refuse calls without this token. An open stream without the token ends at its next message.
  void require(const std::string& token) {
    std::lock_guard lock(mutex_);
    required_ = "Bearer " + token;
  }
  // Calls `on_refusal` before each refusal is sent.
  void before_refusal(std::function<void()> on_refusal) {
    std::lock_guard lock(mutex_);
    on_refusal_ = std::move(on_refusal);
  }
  // Returns the metadata `authorization` of the last call of a method, such as "Query"; "none" before the first call.
  std::string authorization_of(const std::string& method) const {
    std::lock_guard lock(mutex_);
    const auto found = seen_.find(method);
    return found == seen_.end() ? "none" : found->second;
  }
  int calls() const {
    std::lock_guard lock(mutex_);
    return calls_;
  }

 private:
  // Records a call, or a message of a stream. Returns UNAUTHENTICATED if a token is required and the call has no token
  // or another token.
  grpc::Status admit(const grpc::ServerContext& context, const std::string& method) {
    std::lock_guard lock(mutex_);
    ++calls_;
    const auto found = context.client_metadata().find("authorization");
    seen_[method] =
        found == context.client_metadata().end() ? "" : std::string(found->second.data(), found->second.size());
    if (required_.empty() || seen_[method] == required_) return grpc::Status::OK;
    if (on_refusal_) on_refusal_();
    return {grpc::StatusCode::UNAUTHENTICATED, "the token is not accepted"};
  }

  grpc::Status GetServer(grpc::ServerContext* context, const v1::GetServerRequest*, v1::GetServerResponse*) override {
    return admit(*context, "GetServer");
  }
  grpc::Status Backup(grpc::ServerContext* context, const v1::BackupRequest*,
                      grpc::ServerWriter<v1::BackupResponse>*) override {
    return admit(*context, "Backup");
  }
  grpc::Status Query(grpc::ServerContext* context, const v1::QueryRequest*, v1::QueryResponse*) override {
    return admit(*context, "Query");
  }
  grpc::Status StreamQueries(
      grpc::ServerContext* context,
      grpc::ServerReaderWriter<v1::StreamQueriesResponse, v1::StreamQueriesRequest>* stream) override {
    return serve<v1::StreamQueriesRequest, v1::StreamQueriesResponse>(*context, "StreamQueries", *stream,
                                                                      [](auto& answer) { answer.mutable_result(); });
  }
  grpc::Status StreamUpdates(
      grpc::ServerContext* context,
      grpc::ServerReaderWriter<v1::StreamUpdatesResponse, v1::StreamUpdatesRequest>* stream) override {
    return serve<v1::StreamUpdatesRequest, v1::StreamUpdatesResponse>(*context, "StreamUpdates", *stream,
                                                                      [](auto& answer) { answer.mutable_ack(); });
  }
  grpc::Status UploadMesh(grpc::ServerContext* context, grpc::ServerReader<v1::UploadMeshRequest>*,
                          v1::UploadMeshResponse*) override {
    return admit(*context, "UploadMesh");
  }
  grpc::Status DownloadMesh(grpc::ServerContext* context, const v1::DownloadMeshRequest*,
                            grpc::ServerWriter<v1::DownloadMeshResponse>*) override {
    return admit(*context, "DownloadMesh");
  }
  grpc::Status DumpScene(grpc::ServerContext* context, const v1::DumpSceneRequest*,
                         grpc::ServerWriter<v1::DumpSceneResponse>*) override {
    return admit(*context, "DumpScene");
  }

  template <class Request, class Response, class Fill>
  grpc::Status serve(grpc::ServerContext& context, const std::string& method,
                     grpc::ServerReaderWriter<Response, Request>& stream, const Fill& fill) {
    Request request;
    while (stream.Read(&request)) {
      if (grpc::Status status = admit(context, method); !status.ok()) return status;
      Response response;
      response.set_sequence(request.sequence());
      fill(response);
      stream.Write(response);
    }
    return grpc::Status::OK;
  }

  int port_ = 0;
  mutable std::mutex mutex_;
  std::string required_;
  std::function<void()> on_refusal_;
  std::map<std::string, std::string> seen_;
  int calls_ = 0;
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace locus::client::testing

#endif  // LOCUS_TESTS_CLIENT_LIB_GUARDED_SERVER_H_
