#include "client/lib/client.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/lib/authorization.h"
#include "client/lib/connection.h"
#include "client/lib/retry.h"
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

enum class Repeat { kNever, kWhenUnavailable };

// Parameters of a call in addition to its request: link, token, timeout, retries, and the name of its scene (empty
// if the call concerns no scene).
struct CallPlan {
  const Link& link;
  Authorization& authorization;
  RunningCalls& running;
  absl::Duration deadline;
  RetryPolicy retry;
  Repeat repeat = Repeat::kNever;
  absl::string_view scene = {};
  // True if the call is an update with a writer and a batch number: see outcome_unknown().
  bool numbered_update = false;
};

template <class Stub, class Request, class Response>
absl::StatusOr<Response> call(Stub& stub, const CallPlan& plan, const Request& request,
                              grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*)) {
  const absl::Time deadline = absl::Now() + plan.deadline;
  Response response;
  uint64_t token = 0;
  bool lost = false;  // whether the outcome of an attempt is unknown
  const auto once = [&]() -> absl::Status {
    ASSIGN_OR_RETURN(const CallGate::Permit permit, CallGate::enter(plan.link.gate));
    continue_connecting(plan.link, deadline);
    CancellableContext context(&plan.running);
    token = prepare(context, {plan.authorization, deadline, plan.scene});
    response.Clear();
    return to_absl_status((stub.*method)(&context, request, &response));
  };
  const auto attempt = [&]() -> absl::Status {
    absl::Status status = once();
    lost = lost || (!status.ok() && !changed_nothing(status) && !absl::IsUnauthenticated(status));
    return status;
  };
  const auto wait = [&](absl::Duration duration) { wait_connecting(plan.link, duration); };
  const auto attempts = [&] {
    return plan.repeat == Repeat::kNever ? attempt() : with_retries(plan.retry, deadline, attempt, wait);
  };
  absl::Status status = attempts();
  // Repeat even a call that is not safe to repeat: a server that refuses the token has changed nothing.
  if (absl::IsUnauthenticated(status) && plan.authorization.has_newer(token)) status = attempts();
  if (lost && plan.numbered_update && changed_nothing(status)) return outcome_unknown(status);
  RETURN_IF_ERROR(status);
  return response;
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
  std::string address;
  ClientOptions options;
  std::shared_ptr<Authorization> authorization;
  Link latency;  // for Lane::kLatency and unary calls
  Link bulk;
  std::unique_ptr<v1::ServerService::StubInterface> servers;
  std::unique_ptr<v1::SceneService::StubInterface> scenes;
  std::unique_ptr<v1::UpdateService::StubInterface> updates;
  std::unique_ptr<v1::QueryService::StubInterface> queries;
  std::unique_ptr<v1::SceneService::StubInterface> transfers;  // stub on `bulk`, for uploads, downloads and dumps
  std::unique_ptr<RunningCalls> running = std::make_unique<RunningCalls>();

  Connection(std::string with_address, const ClientOptions& with, std::shared_ptr<Authorization> with_authorization,
             Link with_latency, Link with_bulk)
      : address(std::move(with_address)),
        options(with),
        authorization(std::move(with_authorization)),
        latency(std::move(with_latency)),
        bulk(std::move(with_bulk)),
        servers(v1::ServerService::NewStub(latency.channel)),
        scenes(v1::SceneService::NewStub(latency.channel)),
        updates(v1::UpdateService::NewStub(latency.channel)),
        queries(v1::QueryService::NewStub(latency.channel)),
        transfers(v1::SceneService::NewStub(bulk.channel)) {}

  const Link& link_of(Lane lane) const { return lane == Lane::kBulk ? bulk : latency; }
  CallPlan once(absl::string_view scene = {}) const {
    return {latency, *authorization, *running, options.deadline, options.retry, Repeat::kNever, scene};
  }
  CallPlan repeatable(absl::string_view scene = {}) const {
    return {latency, *authorization, *running, options.deadline, options.retry, Repeat::kWhenUnavailable, scene};
  }
  // Returns the plan of a call that applies `batch`, which is repeatable if the batch has a writer and a number.
  CallPlan update(absl::string_view scene, const v1::UpdateBatch& batch) const {
    if (batch.writer() == 0 || batch.batch() == 0) return once(scene);
    CallPlan plan = repeatable(scene);
    plan.numbered_update = true;
    return plan;
  }
  // Prepares a call on `bulk`, whose deadline is `timeout` from now, and returns its header.
  CallHeader bulk_header(absl::Duration timeout, absl::string_view scene = {}) const {
    const absl::Time deadline = absl::Now() + timeout;
    continue_connecting(bulk, deadline);
    return {*authorization, deadline, scene, running.get()};
  }
};

Client::Client(std::unique_ptr<Connection> connection) : connection_(std::move(connection)) {}
Client::~Client() = default;

absl::StatusOr<std::unique_ptr<Client>> Client::connect(absl::string_view address, const ClientOptions& options) {
  ASSIGN_OR_RETURN(const std::string target, target_of(address));
  ASSIGN_OR_RETURN(std::shared_ptr<Authorization> authorization, Authorization::make(options.credentials, target));
  ASSIGN_OR_RETURN(const auto credentials, channel_credentials(options.credentials));
  std::shared_ptr<grpc::Channel> channel = open_channel(target, options, credentials);
  RETURN_IF_ERROR(await_connection(channel, target, options));
  std::shared_ptr<grpc::Channel> bulk = open_channel(target, options, credentials);
  return std::unique_ptr<Client>(
      new Client(std::make_unique<Connection>(target, options, std::move(authorization), Link{channel}, Link{bulk})));
}

std::unique_ptr<Client> Client::in_process(const std::shared_ptr<grpc::Channel>& channel,
                                           std::shared_ptr<CallGate> gate, const ClientOptions& options) {
  const Link link{channel, std::move(gate)};
  return std::unique_ptr<Client>(
      new Client(std::make_unique<Connection>("in-process", options, Authorization::none(), link, link)));
}

const std::string& Client::address() const { return connection_->address; }

absl::StatusOr<v1::GetServerResponse> Client::get_server() const {
  return call(*connection_->servers, connection_->repeatable(), v1::GetServerRequest(),
              &v1::ServerService::StubInterface::GetServer);
}

absl::StatusOr<std::vector<v1::IdentityQuotas>> Client::get_quotas(v1::GetQuotasRequest request) const {
  std::vector<v1::IdentityQuotas> quotas;
  do {
    ASSIGN_OR_RETURN(v1::GetQuotasResponse page, call(*connection_->servers, connection_->repeatable(), request,
                                                      &v1::ServerService::StubInterface::GetQuotas));
    for (v1::IdentityQuotas& entry : *page.mutable_identities()) quotas.push_back(std::move(entry));
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return quotas;
}

absl::StatusOr<Health> Client::health(absl::string_view service) const {
  namespace health = grpc::health::v1;
  const std::unique_ptr<health::Health::StubInterface> stub = health::Health::NewStub(connection_->latency.channel);
  health::HealthCheckRequest request;
  request.set_service(std::string(service));
  ASSIGN_OR_RETURN(const health::HealthCheckResponse response,
                   call(*stub, connection_->repeatable(), request, &health::Health::StubInterface::Check));
  const int status = response.status();
  return health::HealthCheckResponse::ServingStatus_IsValid(status) ? static_cast<Health>(status) : Health::kUnknown;
}

absl::StatusOr<BackupSize> Client::backup(BackupSink& sink) const {
  ASSIGN_OR_RETURN(const CallGate::Permit permit, CallGate::enter(connection_->bulk.gate));
  const std::unique_ptr<v1::ServerService::StubInterface> server =
      v1::ServerService::NewStub(connection_->bulk.channel);
  return download_backup(*server, sink, connection_->bulk_header(connection_->options.backup_deadline));
}

absl::StatusOr<v1::MoveSceneResponse> Client::move_scene(const v1::MoveSceneRequest& request) const {
  return call(*connection_->servers, connection_->once(request.scene()), request,
              &v1::ServerService::StubInterface::MoveScene);
}

absl::StatusOr<v1::Scene> Client::create_scene(const v1::CreateSceneRequest& request) const {
  ASSIGN_OR_RETURN(v1::CreateSceneResponse response, call(*connection_->scenes, connection_->once(request.name()),
                                                          request, &v1::SceneService::StubInterface::CreateScene));
  return std::move(*response.mutable_scene());
}

absl::StatusOr<v1::GetSceneResponse> Client::describe_scene(absl::string_view name) const {
  v1::GetSceneRequest request;
  request.set_name(std::string(name));
  return call(*connection_->scenes, connection_->repeatable(name), request, &v1::SceneService::StubInterface::GetScene);
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
    ASSIGN_OR_RETURN(v1::ListScenesResponse page, call(*connection_->scenes, connection_->repeatable(), request,
                                                       &v1::SceneService::StubInterface::ListScenes));
    for (v1::Scene& scene : *page.mutable_scenes()) scenes.push_back(std::move(scene));
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return scenes;
}

absl::StatusOr<v1::UpdateSceneResponse> Client::update_scene(const v1::UpdateSceneRequest& request) const {
  return call(*connection_->scenes, connection_->once(request.name()), request,
              &v1::SceneService::StubInterface::UpdateScene);
}

absl::Status Client::delete_scene(const v1::DeleteSceneRequest& request) const {
  return call(*connection_->scenes, connection_->once(request.name()), request,
              &v1::SceneService::StubInterface::DeleteScene)
      .status();
}

absl::StatusOr<v1::UploadMeshResponse> Client::upload_mesh(const MeshColumns& mesh,
                                                           const UploadProgress& progress) const {
  ASSIGN_OR_RETURN(const CallGate::Permit permit, CallGate::enter(connection_->bulk.gate));
  return locus::client::upload_mesh(*connection_->transfers, mesh,
                                    connection_->bulk_header(connection_->options.long_deadline), progress);
}

absl::StatusOr<DownloadedMesh> Client::download_mesh(absl::string_view name, const DownloadProgress& progress) const {
  const CallHeader header = connection_->bulk_header(connection_->options.long_deadline);
  absl::StatusOr<DownloadedMesh> mesh = absl::UnknownError("not asked yet");
  const auto attempt = [&]() -> absl::Status {
    ASSIGN_OR_RETURN(const CallGate::Permit permit, CallGate::enter(connection_->bulk.gate));
    continue_connecting(connection_->bulk, header.deadline);
    mesh = locus::client::download_mesh(*connection_->transfers, name, header, progress);
    return mesh.status();
  };
  RETURN_IF_ERROR(with_retries(connection_->options.retry, header.deadline, attempt,
                               [&](absl::Duration duration) { wait_connecting(connection_->bulk, duration); }));
  return mesh;
}

absl::Status Client::read_more_parts(v1::Mesh& mesh) const {
  v1::ListMeshesRequest request;
  request.set_mesh(mesh.name());
  while (static_cast<uint32_t>(mesh.parts_size()) < mesh.part_count()) {
    request.set_first_part(static_cast<uint32_t>(mesh.parts_size()));
    ASSIGN_OR_RETURN(v1::ListMeshesResponse page, call(*connection_->scenes, connection_->repeatable(), request,
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
    ASSIGN_OR_RETURN(v1::ListMeshesResponse page, call(*connection_->scenes, connection_->repeatable(), request,
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
    ASSIGN_OR_RETURN(v1::ListMeshesResponse page, call(*connection_->scenes, connection_->repeatable(), request,
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
  return call(*connection_->scenes, connection_->once(), request, &v1::SceneService::StubInterface::DeleteMesh)
      .status();
}

void Client::cancel_calls() const { connection_->running->cancel_all(); }

absl::StatusOr<v1::ChangeInstancesResponse> Client::change_instances(const v1::ChangeInstancesRequest& request) const {
  CallPlan plan = connection_->once(request.scene());
  plan.deadline = connection_->options.long_deadline;
  return call(*connection_->scenes, plan, request, &v1::SceneService::StubInterface::ChangeInstances);
}

absl::Status Client::dump(const v1::DumpSceneRequest& request,
                          const std::function<absl::Status(const v1::DumpSceneResponse&)>& on_message) const {
  ASSIGN_OR_RETURN(const CallGate::Permit permit, CallGate::enter(connection_->bulk.gate));
  CancellableContext context(connection_->running.get());
  prepare(context, connection_->bulk_header(connection_->options.long_deadline, request.scene()));
  const auto reader = connection_->transfers->DumpScene(&context, request);
  v1::DumpSceneResponse response;
  absl::Status accepted;
  bool arrived = false;
  while (accepted.ok() && reader->Read(&response)) {
    arrived = true;
    accepted = on_message(response);
  }
  if (!accepted.ok()) context.TryCancel();
  const absl::Status end = to_absl_status(reader->Finish());
  return accepted.ok() ? outcome_of_query(end, request.scene(), arrived ? v1::View() : request.view()) : accepted;
}

absl::StatusOr<std::string> Client::call_by_path(const std::string& path, absl::string_view request,
                                                 absl::string_view scene) const {
  PathMethod method(connection_->latency.channel, path);
  const grpc::Slice slice(request.data(), request.size());
  ASSIGN_OR_RETURN(const grpc::ByteBuffer response,
                   call(method, connection_->once(scene), grpc::ByteBuffer(&slice, 1), &PathMethod::run));
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
  ASSIGN_OR_RETURN(v1::ApplyUpdatesResponse response,
                   call(*connection_->updates, plan, request, &v1::UpdateService::StubInterface::ApplyUpdates));
  return std::move(*response.mutable_ack());
}

absl::StatusOr<v1::QueryResult> Client::query(absl::string_view scene, v1::QueryBatch batch) const {
  v1::QueryRequest request;
  request.set_scene(std::string(scene));
  *request.mutable_batch() = std::move(batch);
  absl::StatusOr<v1::QueryResponse> response =
      call(*connection_->queries, connection_->repeatable(scene), request, &v1::QueryService::StubInterface::Query);
  RETURN_IF_ERROR(outcome_of_query(response.status(), scene, request.batch().view()));
  return std::move(*response->mutable_result());
}

absl::StatusOr<StepResult> Client::step(absl::string_view scene, v1::UpdateBatch update, v1::QueryBatch queries) const {
  const CallPlan plan = connection_->update(scene, update);
  v1::StepRequest request;
  request.set_scene(std::string(scene));
  *request.mutable_update() = std::move(update);
  *request.mutable_queries() = std::move(queries);
  ASSIGN_OR_RETURN(v1::StepResponse response,
                   call(*connection_->queries, plan, request, &v1::QueryService::StubInterface::Step));
  if (response.has_error()) return StepResult{std::move(*response.mutable_ack()), to_absl_status(response.error())};
  return StepResult{std::move(*response.mutable_ack()), std::move(*response.mutable_result())};
}

std::unique_ptr<UpdateStream> Client::update_stream(absl::string_view scene, const UpdateStreamOptions& options) const {
  return std::make_unique<UpdateStream>(connection_->link_of(options.lane), connection_->authorization,
                                        std::string(scene), options);
}

std::unique_ptr<QueryStream> Client::query_stream(absl::string_view scene, const QueryStreamOptions& options) const {
  return std::make_unique<QueryStream>(connection_->link_of(options.lane), connection_->authorization,
                                       std::string(scene), options);
}

}  // namespace locus::client
