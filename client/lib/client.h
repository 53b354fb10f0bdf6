// The door of the library: a connection to one locusd, its unary calls, and the streams opened from it. For games,
// simulations and tools; depends on the protocol only.
//
//   auto client = locus::client::Client::connect("127.0.0.1:7575");
//   if (!client.ok()) return client.status();
//   locus::client::QueryBuilder builder;
//   builder.rays().ray({0, 1, 0}, {0, 0, -1});
//   auto result = (*client)->query("arena", builder.build());
//   auto hits = locus::client::RayHits::of(result->blocks(0));
//
// Errors are absl::Status with the server's code and message; error_of() (client/lib/status.h) gives the structured
// refusal. UNAVAILABLE means that nothing answered or the server drains, DEADLINE_EXCEEDED that the outcome of a change
// is unknown. Calls that change nothing are repeated on UNAVAILABLE, within their deadline; an update only if it
// carries `writer` and `batch`; anything else never.
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

namespace locus::client {

inline constexpr char kDefaultAddress[] = "127.0.0.1:7575";

// What grpc.health.v1 says about a server or one of its services.
enum class Health { kUnknown = 0, kServing = 1, kNotServing = 2, kServiceUnknown = 3 };

// Called after each message of an upload with the bytes sent so far and the bytes in all.
using UploadProgress = std::function<void(uint64_t sent, uint64_t total)>;

// Called after each message of a download with the bytes received so far and the bytes in all.
using DownloadProgress = std::function<void(uint64_t received, uint64_t total)>;

// Thread promise: every method may be called from any number of threads at once. Streams hold what they need of the
// connections and may outlive the client. Each client has two connections of its own, so that small calls do not wait
// behind large messages (Lane); the second is made when it is first needed. Both come back by themselves.
class Client {
 public:
  // `address` is host:port (the port may be left out: 7575) or unix:/path. Blocks until the connection stands;
  // UNAVAILABLE naming the address where nothing answers, INVALID_ARGUMENT for an empty address.
  static absl::StatusOr<std::unique_ptr<Client>> connect(absl::string_view address = kDefaultAddress,
                                                         const ClientOptions& options = {});
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  const std::string& address() const;

  // Version, features, limits. Repeated when safe.
  absl::StatusOr<v1::GetServerResponse> get_server() const;
  // Health of the whole server, or of one service by its full name. Repeated when safe.
  absl::StatusOr<Health> health(absl::string_view service = "") const;
  // Everything on the server's disk as it is at one moment, handed to `sink` in this thread; what came in all. Not
  // repeated: a second try begins anew, with a new sink. DATA_LOSS if what came is not what the server announced
  // (files, sizes, hashes), or a path leads out of the backup. UNIMPLEMENTED where the server has no data directory.
  absl::StatusOr<BackupSize> backup(BackupSink& sink) const;

  absl::StatusOr<v1::Scene> create_scene(const v1::CreateSceneRequest& request) const;
  absl::StatusOr<v1::Scene> get_scene(absl::string_view name) const;
  // All pages; only scenes with all of `labels`.
  absl::StatusOr<std::vector<v1::Scene>> list_scenes(const std::map<std::string, std::string>& labels = {}) const;
  absl::Status delete_scene(const v1::DeleteSceneRequest& request) const;

  // Sends the mesh in messages of at most 1 MiB, opening with its SHA-256, and stops as soon as the server answers:
  // bytes it knows are not sent again. Returns when the mesh's tree stands. Not repeated; safe to call again.
  // INVALID_ARGUMENT before anything is sent if a column does not hold triples or is too long to count.
  absl::StatusOr<v1::UploadMeshResponse> upload_mesh(const MeshColumns& mesh,
                                                     const UploadProgress& progress = {}) const;
  // The mesh as it is stored, held in memory whole: 12 bytes a vertex and a triangle. Repeated when safe. DATA_LOSS if
  // what came is not what the server announced (counts, hash) or no mesh (an index beyond the vertices, a vertex that
  // is not finite, parts out of order). Never holds more than was announced.
  absl::StatusOr<DownloadedMesh> download_mesh(absl::string_view name, const DownloadProgress& progress = {}) const;
  // All pages.
  absl::StatusOr<std::vector<v1::Mesh>> list_meshes() const;
  absl::Status delete_mesh(absl::string_view name) const;
  // One atomic change of a scene's instances; returns when it is visible unless `no_wait`.
  absl::StatusOr<v1::ChangeInstancesResponse> change_instances(const v1::ChangeInstancesRequest& request) const;
  // Hands over the scene piece by piece, in this thread. Ends early, with its status, when `piece` fails.
  absl::Status dump(const v1::DumpSceneRequest& request,
                    const std::function<absl::Status(const v1::DumpSceneResponse&)>& piece) const;

  // One batch. For a steady flow use update_stream().
  absl::StatusOr<v1::UpdateAck> apply(absl::string_view scene, v1::UpdateBatch batch) const;
  // One batch, answered whole at one revision.
  absl::StatusOr<v1::QueryResult> query(absl::string_view scene, v1::QueryBatch batch) const;

  // Neither connects before the first batch is sent.
  std::unique_ptr<UpdateStream> update_stream(absl::string_view scene, const UpdateStreamOptions& options = {}) const;
  std::unique_ptr<QueryStream> query_stream(absl::string_view scene, const QueryStreamOptions& options = {}) const;

 private:
  struct Connection;
  explicit Client(std::unique_ptr<Connection> connection);

  std::unique_ptr<Connection> connection_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_CLIENT_H_
