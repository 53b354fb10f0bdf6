// Entry point of the library: a connection to one locusd, its unary calls, and the streams opened from it. For games,
// simulations and tools; depends on the protocol only.
//
//   auto client = locus::client::Client::connect("127.0.0.1:7575");
//   if (!client.ok()) return client.status();
//   locus::client::QueryBuilder builder;
//   builder.rays().ray({0, 1, 0}, {0, 0, -1});
//   auto result = (*client)->query("arena", builder.build());
//   auto hits = locus::client::RayHits::of(result->blocks(0));
//
// Errors are absl::Status with the server's code and message; error_of() (client/lib/status.h) returns the server's
// structured error. UNAVAILABLE means that no server answered or that the server is draining. After DEADLINE_EXCEEDED
// the outcome of a change is unknown. Methods whose comment says "Retried" repeat a call that fails with UNAVAILABLE,
// or with RESOURCE_EXHAUSTED and a retry hint of the server, as often as RetryPolicy allows and until the deadline.
// apply() and step() do so only if the update has `writer` and `batch`, by which the server recognizes a repeated
// batch. In addition, if the server refuses the token of a unary call, and the token file then contains a new token,
// the call is repeated with the new token.
//
// The client of a cluster also repeats every call that a server refused because another one leads the scene, or because
// it shuts down: such a call has changed nothing. The revisions that it sees of a scene never decrease: queries that
// name no revision wait for the highest one that it has seen.
#ifndef LOCUS_CLIENT_LIB_CLIENT_H_
#define LOCUS_CLIENT_LIB_CLIENT_H_

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/lib/backup.h"
#include "client/lib/mesh.h"
#include "client/lib/options.h"
#include "client/lib/query_stream.h"
#include "client/lib/update_stream.h"
#include "locus/v1/query_service.pb.h"
#include "locus/v1/scene_service.pb.h"
#include "locus/v1/server_service.pb.h"
#include "locus/v1/update_service.pb.h"

namespace grpc {
class Channel;
}

namespace locus::client {

class CallGate;

inline constexpr char kDefaultAddress[] = "127.0.0.1:7575";

// Health of a server or of one of its services, as reported by grpc.health.v1.
enum class Health { kUnknown = 0, kServing = 1, kNotServing = 2, kServiceUnknown = 3 };

// Callback for the progress of an upload: `sent` of the `total` bytes of vertices and indices have been sent so far.
using UploadProgress = std::function<void(uint64_t sent, uint64_t total)>;

// Callback for the progress of a download: `received` of the `total` bytes of vertices and indices have been received.
using DownloadProgress = std::function<void(uint64_t received, uint64_t total)>;

// Connection to one server. Thread-safe: any number of threads may call any methods at the same time. Streams share
// ownership of the connections and may outlive the client. Each client has two connections of its own, so that small
// calls do not wait behind large messages (see Lane); the second connection is opened when it is first needed. Both
// connections reconnect automatically.
class Client {
 public:
  // Connects to `address`: host:port, host alone (port 7575) or unix:/path. Blocks until the connection is established.
  // Returns UNAVAILABLE naming the address if no server answers or the TLS handshake fails, or INVALID_ARGUMENT for an
  // empty address. Returns INVALID_ARGUMENT, NOT_FOUND or FAILED_PRECONDITION, with the cause in the message, in these
  // cases: members of options.credentials contradict each other; one of them names an unusable file; a token would be
  // sent unencrypted to another machine (see CredentialOptions::allow_token_without_tls).
  static absl::StatusOr<std::unique_ptr<Client>> connect(absl::string_view address = kDefaultAddress,
                                                         const ClientOptions& options = {});
  // Connects to a cluster by the addresses of some of its servers; connect() does the same with addresses that are
  // separated by commas. Each call and stream goes to the server that leads its scene, which other servers name, and to
  // the next server when one fails (see ClusterOptions). Blocks until one of the addresses answers. Returns
  // INVALID_ARGUMENT without an address, otherwise the errors of connect(); UNAVAILABLE names all addresses.
  static absl::StatusOr<std::unique_ptr<Client>> connect_cluster(const std::vector<std::string>& addresses,
                                                                 const ClientOptions& options = {});
  // Returns a client over `channel`, a channel to a server in the same process (grpc::Server::InProcessChannel). Both
  // lanes use this channel. The server must close `gate` before it shuts down (client/lib/call_gate.h). The
  // credentials, connect_timeout, wait_for_server and message sizes of `options` have no effect: the channel has none
  // of them, or limits of its own. Programs use EmbeddedServer::connect() instead.
  static std::unique_ptr<Client> in_process(const std::shared_ptr<grpc::Channel>& channel,
                                            std::shared_ptr<CallGate> gate, const ClientOptions& options = {});
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  // Returns the server's address, including the port; `in-process` for a client of in_process(); the given addresses of
  // a cluster, joined by commas.
  const std::string& address() const;

  // Returns the server's version, features and limits. Retried.
  absl::StatusOr<v1::GetServerResponse> get_server() const;
  // Returns the quotas of this caller and how much of each quota is in use. If `request` names another identity or asks
  // for all identities, returns their quotas instead. Reads all pages. Retried.
  absl::StatusOr<std::vector<v1::IdentityQuotas>> get_quotas(v1::GetQuotasRequest request = {}) const;
  // Returns the health of the whole server, or of one service given by its full name. Retried.
  absl::StatusOr<Health> health(absl::string_view service = "") const;
  // Passes a consistent copy of the server's data directory to `sink`, in this thread, and returns the size of the
  // copy. Not retried; to try again, call backup() with a new sink. Returns DATA_LOSS if the received files differ from
  // the server's announcement (number of files, sizes, hashes) or if a path is invalid (BackupPaths::add). Returns
  // UNIMPLEMENTED if the server has no data directory.
  absl::StatusOr<BackupSize> backup(BackupSink& sink) const;

  // Create, read, list, change and delete scenes. Reading and listing are retried; the others are not.
  // list_scenes() reads all pages and returns every scene that has all of `labels`.
  absl::StatusOr<v1::Scene> create_scene(const v1::CreateSceneRequest& request) const;
  absl::StatusOr<v1::Scene> get_scene(absl::string_view name) const;
  // Returns the scene, the sizes of its structures, and what queries have cost.
  absl::StatusOr<v1::GetSceneResponse> describe_scene(absl::string_view name) const;
  absl::StatusOr<std::vector<v1::Scene>> list_scenes(const std::map<std::string, std::string>& labels = {}) const;
  absl::StatusOr<v1::UpdateSceneResponse> update_scene(const v1::UpdateSceneRequest& request) const;
  absl::Status delete_scene(const v1::DeleteSceneRequest& request) const;

  // Moves the leadership of a scene to another server of the cluster. Not retried. Of a client with one address, call
  // it at the leader: any other server refuses with REASON_ELSEWHERE, and error_of() has the leader's address.
  absl::StatusOr<v1::MoveSceneResponse> move_scene(const v1::MoveSceneRequest& request) const;

  // Uploads a mesh in messages of at most 1 MiB. The first message has the mesh's SHA-256 and all parts of the mesh, so
  // it can be larger. The upload stops as soon as the server answers; thus a mesh that the server already has is not
  // sent again. Returns when the server has built the mesh's tree. Not retried; safe to call again. Returns
  // INVALID_ARGUMENT, before anything is sent, if the length of a column is not a multiple of three or is too large.
  absl::StatusOr<v1::UploadMeshResponse> upload_mesh(const MeshColumns& mesh,
                                                     const UploadProgress& progress = {}) const;
  // Downloads a mesh as the server stores it, completely into memory: 12 bytes per vertex and per triangle. Retried.
  // Returns DATA_LOSS if the received mesh differs from the server's announcement (counts, hash) or is invalid (an
  // index beyond the vertices, a vertex that is not finite, parts out of order). Never holds more data than was
  // announced.
  absl::StatusOr<DownloadedMesh> download_mesh(absl::string_view name, const DownloadProgress& progress = {}) const;
  // Returns all meshes of the server with all their parts, or without their parts, read page by page. Retried.
  absl::StatusOr<std::vector<v1::Mesh>> list_meshes(MeshParts parts = MeshParts::kAll) const;
  // Returns a mesh with all its parts, read page by page; NOT_FOUND if no mesh has the name. Retried.
  absl::StatusOr<v1::Mesh> get_mesh(absl::string_view name) const;
  // Deletes a mesh. Not retried.
  absl::Status delete_mesh(absl::string_view name) const;
  // Applies one atomic change of a scene's instances. Returns when queries see the change or, if request.no_wait is
  // set, as soon as the server has accepted the change. Not retried.
  absl::StatusOr<v1::ChangeInstancesResponse> change_instances(const v1::ChangeInstancesRequest& request) const;
  // Passes the contents of a scene to `on_message`, message by message, in this thread. If `on_message` returns an
  // error, stops and returns that error. Not retried.
  absl::Status dump(const v1::DumpSceneRequest& request,
                    const std::function<absl::Status(const v1::DumpSceneResponse&)>& on_message) const;

  // Applies one batch. Retried only if the batch carries `writer` and `batch`. If a retry is refused, the error has no
  // reason, because an earlier attempt may have applied the batch. For regular batches use update_stream().
  absl::StatusOr<v1::UpdateAck> apply(absl::string_view scene, v1::UpdateBatch batch) const;
  // Sends one batch of queries and returns the answers, all at one revision. Retried. For regular batches use
  // query_stream().
  absl::StatusOr<v1::QueryResult> query(absl::string_view scene, v1::QueryBatch batch) const;
  // Makes a step: applies `update`, then answers `queries` at a revision that contains it, in one call. An error means
  // that the step was refused; if the server sent it, nothing was changed. An error of queries whose update was applied
  // is in StepResult::result. Retried like apply(). For a step every tick use QueryStream::step().
  absl::StatusOr<StepResult> step(absl::string_view scene, v1::UpdateBatch update, v1::QueryBatch queries) const;

  // Cancels the calls in progress, which then return CANCELLED; whether a change was made is unknown. Does not end
  // streams.
  void cancel_calls() const;

  // Calls any unary method by its path, such as "/locus.v1.SceneService/GetScene", with a serialized request, and
  // returns the serialized response. `scene` is the scene that the request names, or empty. Not retried.
  absl::StatusOr<std::string> call_by_path(const std::string& path, absl::string_view request,
                                           absl::string_view scene = "") const;

  // Open a stream for one scene. The stream starts its call to the server when the first batch is sent.
  std::unique_ptr<UpdateStream> update_stream(absl::string_view scene, const UpdateStreamOptions& options = {}) const;
  std::unique_ptr<QueryStream> query_stream(absl::string_view scene, const QueryStreamOptions& options = {}) const;

 private:
  struct Connection;
  explicit Client(std::unique_ptr<Connection> connection);
  // Appends the parts of a listed mesh that did not fit into the reply.
  absl::Status read_more_parts(v1::Mesh& mesh) const;

  std::unique_ptr<Connection> connection_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_CLIENT_H_
