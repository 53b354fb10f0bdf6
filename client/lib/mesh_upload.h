// Transmission of the message stream of Client::upload_mesh. Internal to the library.
#ifndef LOCUS_CLIENT_LIB_MESH_UPLOAD_H_
#define LOCUS_CLIENT_LIB_MESH_UPLOAD_H_

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client/lib/client.h"
#include "client/lib/mesh.h"
#include "locus/v1/scene_service.grpc.pb.h"

namespace locus::client {

// Performs Client::upload_mesh with this stub. The first message has the hash and the counts but no columns, so that a
// server that already has the mesh can answer before any column is sent.
absl::StatusOr<v1::UploadMeshResponse> upload_mesh(v1::SceneService::StubInterface& stub, const MeshColumns& mesh,
                                                   absl::Time deadline, const UploadProgress& progress);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_MESH_UPLOAD_H_
