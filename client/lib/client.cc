#include "client/lib/client.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include "client/lib/authorization.h"
#include "client/lib/connection.h"
#include "client/lib/open_cluster.h"
#include "client/lib/router.h"
#include "client/lib/status.h"
#include "client/lib/transfers.h"
#include "client/lib/writer.h"
#include "core/base/status_macros.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "grpcpp/channel.h"
#include "grpcpp/generic/generic_stub.h"
#include "locus/v1/query_service.grpc.pb.h"
#include "locus/v1/scene_service.grpc.pb.h"
#include "locus/v1/server_service.grpc.pb.h"
#include "locus/v1/update_service.grpc.pb.h"

namespace locus::client {
namespace {

// Runs a unary call: `invoke` makes it at a server.
template <class Response, class Invoke>
absl::StatusOr<Response> call_with(Router& router, const CallPlan& plan, const Invoke& invoke,
                                   Reading* reading = nullptr) {
  Response response;
  const auto attempt = [&](const ServerLinks& server, absl::Time deadline, uint64_t& token) -> absl::Status {
    ASSIGN_OR_RETURN(const CallGate::Permit permit, CallGate::enter(server.latency.gate));
    continue_connecting(server.latency, deadline);
    CancellableContext context(&router.running());
    token = prepare(context, {*server.authorization, deadline, plan.scene});
    response.Clear();
    return to_absl_status(invoke(server, context, response));
  };
  RETURN_IF_ERROR(router.run(plan, attempt, reading));
  return response;
}

// Calls a method of one of the stubs of a server.
template <class Stub, class Request, class Response>
absl::StatusOr<Response> call(Router& router, const CallPlan& plan, std::unique_ptr<Stub> ServerLinks::*stub,
                              const Request& request,
                              grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*)) {
  return call_with<Response>(router, plan,
                             [&](const ServerLinks& server, grpc::ClientContext& context, Response& response) {
                               return (*(server.*stub).*method)(&context, request, &response);
                             });
}

// Unary method that is known by its path only.
class PathMethod {
 public:
  PathMethod(std::shared_ptr<grpc::ChannelInterface> channel, std::string path)
      : stub_(std::move(channel)), path_(std::move(path)) {}

  grpc::Status run(grpc::ClientContext* context, const grpc::ByteBuffer& request, grpc::ByteBuffer* response) {
    grpc::CompletionQueue queue;
    const auto reader = stub_.PrepareUnaryCall(context, path_, request, &queue);
    reader->StartCall();
    grpc::Status status;
    reader->Finish(response, &status, nullptr);
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
    return status;
  }

 private:
  grpc::GenericStub stub_;
  const std::string path_;
};

// Returns the outcome of a query: `status`, marked by mark_read_only(). If the deadline passed in this client, so that
// the server sent no error of its own, returns an error that names the revision for which the query waits.
absl::Status outcome_of_query(const absl::Status& status, absl::string_view scene, const v1::View& view) {
  if (status.ok()) return status;
  if (!absl::IsDeadlineExceeded(status) || error_of(status)) return mark_read_only(status);
  std::string message = "the query was not answered in time";
  if (view.has_at_least())
    absl::StrAppend(&message, "; scene '", scene, "' may not have reached revision ", view.at_least(),
                    " yet, for which the query waits");
  return mark_read_only(absl::DeadlineExceededError(message));
}

}  // namespace

struct Client::Connection {
  ClientOptions options;
  std::shared_ptr<Router> router;  // streams share it
  std::string address = router->address();

  CallPlan once(absl::string_view scene = {}) const {
    const bool cluster = router->routes() != nullptr;
    return {cluster ? options.cluster.deadline : options.deadline, options.retry, Repeat::kNever, scene};
  }
  CallPlan repeatable(absl::string_view scene = {}) const {
    CallPlan plan = once(scene);
    plan.repeat = Repeat::kWhenUnavailable;
    return plan;
  }
  // Returns the plan of a call that applies `batch`, which is repeatable if the batch has a writer and a number.
  CallPlan update(absl::string_view scene, const v1::UpdateBatch& batch) const {
    if (batch.writer() == 0 || batch.batch() == 0) return once(scene);
    CallPlan plan = repeatable(scene);
    plan.numbered_update = true;
    return plan;
  }
  // Returns the plan of a transfer, whose deadline is `timeout` from its start.
  CallPlan transfer(absl::Duration timeout, absl::string_view scene = {}) const {
    return {timeout, options.retry, Repeat::kNever, scene, false, {}, Lane::kBulk};
  }
  // Runs a transfer: `invoke` makes it at a server.
  absl::Status run_transfer(const CallPlan& plan,
                            const std::function<absl::Status(const ServerLinks&, const CallHeader&)>& invoke) const {
    return router->run(plan, [&](const ServerLinks& server, absl::Time deadline, uint64_t&) -> absl::Status {
      continue_connecting(server.bulk, deadline);
      ASSIGN_OR_RETURN(const CallGate::Permit permit, CallGate::enter(server.bulk.gate));
      return invoke(server, {*server.authorization, deadline, plan.scene, &router->running()});
    });
  }
  // Notes the revision of an ack.
  void saw(absl::string_view scene, const v1::UpdateAck& ack) const {
    if (router->routes() != nullptr) router->routes()->saw(scene, {ack.epoch(), ack.revision()}, true);
  }
};

Client::Client(std::unique_ptr<Connection> connection) : connection_(std::move(connection)) {}
Client::~Client() = default;

absl::StatusOr<std::unique_ptr<Client>> Client::connect(absl::string_view address, const ClientOptions& options) {
  if (absl::StrContains(address, ',') && !absl::StartsWith(address, "unix:"))
    return connect_cluster(absl::StrSplit(address, ','), options);
  ASSIGN_OR_RETURN(const std::string target, target_of(address));
  ASSIGN_OR_RETURN(std::shared_ptr<Authorization> authorization, Authorization::make(options.credentials, target));
  ASSIGN_OR_RETURN(const auto credentials, channel_credentials(options.credentials));
  std::shared_ptr<grpc::Channel> channel = open_channel(target, options, credentials);
  RETURN_IF_ERROR(await_connection(channel, target, options));
  std::shared_ptr<grpc::Channel> bulk = open_channel(target, options, credentials);
  auto server = std::make_shared<ServerLinks>(target, std::move(authorization), Link{channel}, Link{bulk});
  return std::unique_ptr<Client>(
      new Client(std::make_unique<Connection>(Connection{options, std::make_shared<Router>(std::move(server))})));
}

absl::StatusOr<std::unique_ptr<Client>> Client::connect_cluster(const std::vector<std::string>& addresses,
                                                                const ClientOptions& options) {
  ASSIGN_OR_RETURN(std::shared_ptr<Router> router, open_cluster(addresses, options));
  return std::unique_ptr<Client>(new Client(std::make_unique<Connection>(Connection{options, std::move(router)})));
}

std::unique_ptr<Client> Client::in_process(const std::shared_ptr<grpc::Channel>& channel,
                                           std::shared_ptr<CallGate> gate, const ClientOptions& options) {
  const Link link{channel, std::move(gate)};
  auto server = std::make_shared<ServerLinks>("in-process", Authorization::none(), link, link);
  return std::unique_ptr<Client>(
      new Client(std::make_unique<Connection>(Connection{options, std::make_shared<Router>(std::move(server))})));
}

const std::string& Client::address() const { return connection_->address; }

absl::StatusOr<v1::GetServerResponse> Client::get_server() const {
  return call(*connection_->router, connection_->repeatable(), &ServerLinks::servers, v1::GetServerRequest(),
              &v1::ServerService::StubInterface::GetServer);
}

absl::StatusOr<std::vector<v1::IdentityQuotas>> Client::get_quotas(v1::GetQuotasRequest request) const {
  std::vector<v1::IdentityQuotas> quotas;
  do {
    ASSIGN_OR_RETURN(v1::GetQuotasResponse page,
                     call(*connection_->router, connection_->repeatable(), &ServerLinks::servers, request,
                          &v1::ServerService::StubInterface::GetQuotas));
    for (v1::IdentityQuotas& entry : *page.mutable_identities()) quotas.push_back(std::move(entry));
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return quotas;
}

absl::StatusOr<Health> Client::health(absl::string_view service) const {
  namespace health = grpc::health::v1;
  health::HealthCheckRequest request;
  request.set_service(std::string(service));
  ASSIGN_OR_RETURN(const health::HealthCheckResponse response,
                   call_with<health::HealthCheckResponse>(
                       *connection_->router, connection_->repeatable(),
                       [&](const ServerLinks& server, grpc::ClientContext& context, auto& reply) {
                         return health::Health::NewStub(server.latency.channel)->Check(&context, request, &reply);
                       }));
  const int status = response.status();
  return health::HealthCheckResponse::ServingStatus_IsValid(status) ? static_cast<Health>(status) : Health::kUnknown;
}

absl::StatusOr<BackupSize> Client::backup(BackupSink& sink) const {
  absl::StatusOr<BackupSize> size = absl::UnknownError("not asked yet");
  const auto invoke = [&](const ServerLinks& server, const CallHeader& header) {
    size = download_backup(*v1::ServerService::NewStub(server.bulk.channel), sink, header);
    return absl::OkStatus();  // not repeated, since the sink has been used
  };
  RETURN_IF_ERROR(connection_->run_transfer(connection_->transfer(connection_->options.backup_deadline), invoke));
  return size;
}

absl::StatusOr<v1::Scene> Client::create_scene(const v1::CreateSceneRequest& request) const {
  CallPlan plan = connection_->once(request.name());
  plan.route = request.spec().static_from();
  ASSIGN_OR_RETURN(v1::CreateSceneResponse response, call(*connection_->router, plan, &ServerLinks::scenes, request,
                                                          &v1::SceneService::StubInterface::CreateScene));
  return std::move(*response.mutable_scene());
}

absl::StatusOr<v1::GetSceneResponse> Client::describe_scene(absl::string_view name) const {
  v1::GetSceneRequest request;
  request.set_name(std::string(name));
  return call(*connection_->router, connection_->repeatable(name), &ServerLinks::scenes, request,
              &v1::SceneService::StubInterface::GetScene);
}

absl::StatusOr<v1::Scene> Client::get_scene(absl::string_view name) const {
  ASSIGN_OR_RETURN(v1::GetSceneResponse response, describe_scene(name));
  return std::move(*response.mutable_scene());
}

absl::StatusOr<std::vector<v1::Scene>> Client::list_scenes(const std::map<std::string, std::string>& labels) const {
  v1::ListScenesRequest request;
  request.mutable_labels()->insert(labels.begin(), labels.end());
  std::vector<v1::Scene> scenes;
  do {
    ASSIGN_OR_RETURN(v1::ListScenesResponse page,
                     call(*connection_->router, connection_->repeatable(), &ServerLinks::scenes, request,
                          &v1::SceneService::StubInterface::ListScenes));
    for (v1::Scene& scene : *page.mutable_scenes()) scenes.push_back(std::move(scene));
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return scenes;
}

absl::StatusOr<v1::UpdateSceneResponse> Client::update_scene(const v1::UpdateSceneRequest& request) const {
  return call(*connection_->router, connection_->once(request.name()), &ServerLinks::scenes, request,
              &v1::SceneService::StubInterface::UpdateScene);
}

absl::Status Client::delete_scene(const v1::DeleteSceneRequest& request) const {
  const absl::Status status = call(*connection_->router, connection_->once(request.name()), &ServerLinks::scenes,
                                   request, &v1::SceneService::StubInterface::DeleteScene)
                                  .status();
  if (status.ok() && connection_->router->routes() != nullptr) connection_->router->routes()->forget(request.name());
  return status;
}

absl::StatusOr<v1::UploadMeshResponse> Client::upload_mesh(const MeshColumns& mesh,
                                                           const UploadProgress& progress) const {
  absl::StatusOr<v1::UploadMeshResponse> response = absl::UnknownError("not sent yet");
  const auto invoke = [&](const ServerLinks& server, const CallHeader& header) {
    response = locus::client::upload_mesh(*server.transfers, mesh, header, progress);
    return response.status();
  };
  RETURN_IF_ERROR(connection_->run_transfer(connection_->transfer(connection_->options.long_deadline), invoke));
  return response;
}

absl::StatusOr<DownloadedMesh> Client::download_mesh(absl::string_view name, const DownloadProgress& progress) const {
  absl::StatusOr<DownloadedMesh> mesh = absl::UnknownError("not asked yet");
  const auto invoke = [&](const ServerLinks& server, const CallHeader& header) {
    mesh = locus::client::download_mesh(*server.transfers, name, header, progress);
    return mesh.status();
  };
  CallPlan plan = connection_->transfer(connection_->options.long_deadline);
  plan.repeat = Repeat::kWhenUnavailable;
  RETURN_IF_ERROR(connection_->run_transfer(plan, invoke));
  return mesh;
}

absl::Status Client::read_more_parts(v1::Mesh& mesh) const {
  v1::ListMeshesRequest request;
  request.set_mesh(mesh.name());
  while (static_cast<uint32_t>(mesh.parts_size()) < mesh.part_count()) {
    request.set_first_part(static_cast<uint32_t>(mesh.parts_size()));
    ASSIGN_OR_RETURN(v1::ListMeshesResponse page,
                     call(*connection_->router, connection_->repeatable(), &ServerLinks::scenes, request,
                          &v1::SceneService::StubInterface::ListMeshes));
    if (page.meshes_size() != 1 || page.meshes(0).sha256() != mesh.sha256() || page.meshes(0).parts().empty() ||
        page.meshes(0).part_count() != mesh.part_count())
      return absl::AbortedError(absl::StrCat("mesh ", mesh.name(), " was replaced while its parts were read"));
    mesh.mutable_parts()->MergeFrom(page.meshes(0).parts());
  }
  return absl::OkStatus();
}

absl::StatusOr<v1::Mesh> Client::get_mesh(absl::string_view name) const {
  v1::ListMeshesRequest request;
  request.set_mesh(std::string(name));
  do {
    ASSIGN_OR_RETURN(v1::ListMeshesResponse page,
                     call(*connection_->router, connection_->repeatable(), &ServerLinks::scenes, request,
                          &v1::SceneService::StubInterface::ListMeshes));
    // An older server ignores the name in the request and lists all meshes.
    for (v1::Mesh& mesh : *page.mutable_meshes()) {
      if (mesh.name() != name) continue;
      RETURN_IF_ERROR(read_more_parts(mesh));
      return std::move(mesh);
    }
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return absl::NotFoundError(absl::StrCat("no mesh is called '", name, "'"));
}

absl::StatusOr<std::vector<v1::Mesh>> Client::list_meshes(MeshParts parts) const {
  v1::ListMeshesRequest request;
  request.set_without_parts(parts == MeshParts::kNone);
  std::vector<v1::Mesh> meshes;
  do {
    ASSIGN_OR_RETURN(v1::ListMeshesResponse page,
                     call(*connection_->router, connection_->repeatable(), &ServerLinks::scenes, request,
                          &v1::SceneService::StubInterface::ListMeshes));
    for (v1::Mesh& mesh : *page.mutable_meshes()) {
      if (parts == MeshParts::kAll) {
        const absl::Status status = read_more_parts(mesh);
        if (absl::IsNotFound(status)) continue;  // deleted meanwhile
        RETURN_IF_ERROR(status);
      }
      meshes.push_back(std::move(mesh));
    }
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return meshes;
}

absl::Status Client::delete_mesh(absl::string_view name) const {
  v1::DeleteMeshRequest request;
  request.set_mesh(std::string(name));
  return call(*connection_->router, connection_->once(), &ServerLinks::scenes, request,
              &v1::SceneService::StubInterface::DeleteMesh)
      .status();
}

void Client::cancel_calls() const { connection_->router->running().cancel_all(); }

absl::StatusOr<v1::ChangeInstancesResponse> Client::change_instances(const v1::ChangeInstancesRequest& request) const {
  CallPlan plan = connection_->once(request.scene());
  plan.deadline = connection_->options.long_deadline;
  return call(*connection_->router, plan, &ServerLinks::scenes, request,
              &v1::SceneService::StubInterface::ChangeInstances);
}

absl::Status Client::dump(const v1::DumpSceneRequest& request,
                          const std::function<absl::Status(const v1::DumpSceneResponse&)>& on_message) const {
  absl::Status accepted, end;
  bool arrived = false;
  const auto invoke = [&](const ServerLinks& server, const CallHeader& header) {
    CancellableContext context(header.running);
    prepare(context, header);
    const auto reader = server.transfers->DumpScene(&context, request);
    v1::DumpSceneResponse response;
    while (accepted.ok() && reader->Read(&response)) {
      arrived = true;
      accepted = on_message(response);
    }
    if (!accepted.ok()) context.TryCancel();
    end = to_absl_status(reader->Finish());
    return arrived ? absl::OkStatus() : end;  // not repeated once messages have been passed on
  };
  const CallPlan plan = connection_->transfer(connection_->options.long_deadline, request.scene());
  if (absl::Status status = connection_->run_transfer(plan, invoke); !status.ok()) end = std::move(status);
  return accepted.ok() ? outcome_of_query(end, request.scene(), arrived ? v1::View() : request.view()) : accepted;
}

absl::StatusOr<v1::MoveSceneResponse> Client::move_scene(const v1::MoveSceneRequest& request) const {
  return call(*connection_->router, connection_->once(request.scene()), &ServerLinks::servers, request,
              &v1::ServerService::StubInterface::MoveScene);
}

absl::StatusOr<std::string> Client::call_by_path(const std::string& path, absl::string_view request,
                                                 absl::string_view scene) const {
  const grpc::Slice slice(request.data(), request.size());
  ASSIGN_OR_RETURN(
      const grpc::ByteBuffer response,
      call_with<grpc::ByteBuffer>(
          *connection_->router, connection_->once(scene),
          [&](const ServerLinks& server, grpc::ClientContext& context, grpc::ByteBuffer& reply) {
            return PathMethod(server.latency.channel, path).run(&context, grpc::ByteBuffer(&slice, 1), &reply);
          }));
  std::vector<grpc::Slice> slices;
  if (!response.Dump(&slices).ok()) return absl::DataLossError("the answer cannot be read");
  std::string bytes;
  for (const grpc::Slice& part : slices) bytes.append(reinterpret_cast<const char*>(part.begin()), part.size());
  return bytes;
}

absl::StatusOr<v1::UpdateAck> Client::apply(absl::string_view scene, v1::UpdateBatch batch) const {
  const CallPlan plan = connection_->update(scene, batch);
  v1::ApplyUpdatesRequest request;
  request.set_scene(std::string(scene));
  *request.mutable_batch() = std::move(batch);
  ASSIGN_OR_RETURN(v1::ApplyUpdatesResponse response, call(*connection_->router, plan, &ServerLinks::updates, request,
                                                           &v1::UpdateService::StubInterface::ApplyUpdates));
  connection_->saw(scene, response.ack());
  return std::move(*response.mutable_ack());
}

absl::StatusOr<v1::QueryResult> Client::query(absl::string_view scene, v1::QueryBatch batch) const {
  v1::QueryRequest request;
  request.set_scene(std::string(scene));
  *request.mutable_batch() = std::move(batch);
  const v1::View view = request.batch().view();
  std::optional<Reading> reading = connection_->router->reading(scene, view);
  const auto invoke = [&](const ServerLinks& server, grpc::ClientContext& context, v1::QueryResponse& reply) {
    if (reading) *request.mutable_batch()->mutable_view() = reading->next_view();
    return server.queries->Query(&context, request, &reply);
  };
  absl::StatusOr<v1::QueryResponse> response = call_with<v1::QueryResponse>(
      *connection_->router, connection_->repeatable(scene), invoke, reading ? &*reading : nullptr);
  RETURN_IF_ERROR(outcome_of_query(response.status(), scene, view));
  if (reading) reading->answered({response->result().epoch(), response->result().revision()});
  return std::move(*response->mutable_result());
}

absl::StatusOr<StepResult> Client::step(absl::string_view scene, v1::UpdateBatch update, v1::QueryBatch queries) const {
  const CallPlan plan = connection_->update(scene, update);
  v1::StepRequest request;
  request.set_scene(std::string(scene));
  *request.mutable_update() = std::move(update);
  *request.mutable_queries() = std::move(queries);
  ASSIGN_OR_RETURN(v1::StepResponse response, call(*connection_->router, plan, &ServerLinks::queries, request,
                                                   &v1::QueryService::StubInterface::Step));
  connection_->saw(scene, response.ack());
  if (response.has_error()) return StepResult{std::move(*response.mutable_ack()), to_absl_status(response.error())};
  return StepResult{std::move(*response.mutable_ack()), std::move(*response.mutable_result())};
}

std::unique_ptr<UpdateStream> Client::update_stream(absl::string_view scene, const UpdateStreamOptions& options) const {
  return std::make_unique<UpdateStream>(connection_->router, std::string(scene), options);
}

std::unique_ptr<QueryStream> Client::query_stream(absl::string_view scene, const QueryStreamOptions& options) const {
  return std::make_unique<QueryStream>(connection_->router, std::string(scene), options);
}

}  // namespace locus::client
