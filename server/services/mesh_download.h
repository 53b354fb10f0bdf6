// DownloadMesh: sends a mesh as it is stored, in pieces of bounded size, from which an equal mesh can be uploaded.
// Functions without state; any thread.
#ifndef LOCUS_SERVER_SERVICES_MESH_DOWNLOAD_H_
#define LOCUS_SERVER_SERVICES_MESH_DOWNLOAD_H_

#include <grpcpp/support/sync_stream.h>

#include <functional>

#include "absl/status/status.h"
#include "core/scene/registry.h"
#include "locus/v1/scene_service.pb.h"
#include "server/rpc/call.h"

namespace locus::server {

// Function that writes a piece to the caller; returns false to end the download.
using TakeMeshPiece = std::function<bool(const v1::DownloadMeshResponse&)>;

// Sends the description, then parts, vertices and indices. Every piece but the last is full, and there is at least one.
// Returns false if `take` ended the download.
bool send_mesh(const Registry::NamedMesh& mesh, const TakeMeshPiece& take);

// Serves one DownloadMesh call. Keeps the mesh alive until its last piece is sent, even if it is deleted meanwhile.
absl::Status download_mesh(Host& host, const Caller& caller, const v1::DownloadMeshRequest& request,
                           grpc::ServerWriter<v1::DownloadMeshResponse>& writer);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_MESH_DOWNLOAD_H_
