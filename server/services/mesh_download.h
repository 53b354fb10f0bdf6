// DownloadMesh: a mesh as it is stored, in pieces of bounded size, from which an equal mesh can be uploaded.
#ifndef LOCUS_SERVER_SERVICES_MESH_DOWNLOAD_H_
#define LOCUS_SERVER_SERVICES_MESH_DOWNLOAD_H_

#include <grpcpp/support/sync_stream.h>

#include <functional>

#include "absl/status/status.h"
#include "core/scene/registry.h"
#include "locus/v1/scene_service.pb.h"
#include "server/rpc/call.h"

namespace locus::server {

// Takes a piece; false ends the download.
using TakeMeshPiece = std::function<bool(const v1::DownloadMeshResponse&)>;

// The description, then parts, vertices and indices, each piece as full as it may be. At least one piece. False when
// `take` ended it.
bool send_mesh(const Registry::NamedMesh& mesh, const TakeMeshPiece& take);

// Holds the mesh until its last piece is sent, whoever deletes it meanwhile.
absl::Status download_mesh(Host& host, const Caller& caller, const v1::DownloadMeshRequest& request,
                           grpc::ServerWriter<v1::DownloadMeshResponse>& writer);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_MESH_DOWNLOAD_H_
