// Implementations of those calls of Client that stream meshes and backups. Internal to the library.
#ifndef LOCUS_CLIENT_LIB_TRANSFERS_H_
#define LOCUS_CLIENT_LIB_TRANSFERS_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/lib/backup.h"
#include "client/lib/client.h"
#include "client/lib/connection.h"
#include "client/lib/mesh.h"
#include "locus/v1/scene_service.grpc.pb.h"
#include "locus/v1/server_service.grpc.pb.h"

namespace locus::client {

// Implements Client::upload_mesh with this stub. The first message has the hash and the counts but no columns, so that
// a server that already has the mesh can answer before any column is sent.
absl::StatusOr<v1::UploadMeshResponse> upload_mesh(v1::SceneService::StubInterface& stub, const MeshColumns& mesh,
                                                   const CallHeader& header, const UploadProgress& progress);

// Implements one attempt of Client::download_mesh; Client::download_mesh repeats failed attempts.
absl::StatusOr<DownloadedMesh> download_mesh(v1::SceneService::StubInterface& stub, absl::string_view name,
                                             const CallHeader& header, const DownloadProgress& progress);

// Implements Client::backup with this stub. Fails with DEADLINE_EXCEEDED after the header's deadline.
absl::StatusOr<BackupSize> download_backup(v1::ServerService::StubInterface& stub, BackupSink& sink,
                                           const CallHeader& header);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_TRANSFERS_H_
