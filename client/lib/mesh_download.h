// Reception of the message stream of Client::download_mesh. Internal to the library.
#ifndef LOCUS_CLIENT_LIB_MESH_DOWNLOAD_H_
#define LOCUS_CLIENT_LIB_MESH_DOWNLOAD_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "client/lib/client.h"
#include "client/lib/mesh.h"
#include "locus/v1/scene_service.grpc.pb.h"

namespace locus::client {

// Performs one attempt of Client::download_mesh, which repeats failed attempts.
absl::StatusOr<DownloadedMesh> download_mesh(v1::SceneService::StubInterface& stub, absl::string_view name,
                                             absl::Time deadline, const DownloadProgress& progress);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_MESH_DOWNLOAD_H_
