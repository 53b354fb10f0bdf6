// UploadMesh: collects a mesh from the pieces of a stream, checks it against the announced counts and hash, builds its
// tree and registers it.
#ifndef LOCUS_SERVER_SERVICES_MESH_UPLOAD_H_
#define LOCUS_SERVER_SERVICES_MESH_UPLOAD_H_

#include <grpcpp/support/sync_stream.h>

#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "core/scene/statics/static_mesh.h"
#include "locus/v1/scene_service.grpc.pb.h"
#include "server/rpc/call.h"

namespace locus::server {

// Returns the SHA-256 of vertex count, triangle count, vertices and indices, as UploadMeshRequest.sha256 defines it.
// The lengths must be multiples of three.
Sha256 mesh_hash(absl::Span<const float> vertices, absl::Span<const uint32_t> indices);

// A mesh that arrives in pieces. Invariant: it never holds more numbers than were announced. For one thread at a time.
class MeshUpload {
 public:
  // Checks the first message's form and limits before anything is allocated.
  static absl::StatusOr<MeshUpload> begin(const v1::UploadMeshRequest& first);

  // Appends the columns of `message`, which may be the first message or a later one.
  absl::Status append(const v1::UploadMeshRequest& message);
  // Appends the second or a later message of the upload. Such a message may contain only columns.
  absl::Status append_later(const v1::UploadMeshRequest& message);

  const std::string& name() const { return name_; }
  const std::optional<Sha256>& announced() const { return announced_; }
  // Returns the announced parts; none after finish().
  const std::vector<MeshPart>& parts() const { return parts_; }
  // Returns whether `mesh` has as many vertices and triangles as were announced.
  bool has_counts_of(const StaticMesh& mesh) const;

  struct Complete {
    Sha256 sha256;
    TriangleMesh mesh;
  };
  // Checks that the upload is complete and correct, and returns the mesh with its hash. Leaves the upload empty.
  absl::StatusOr<Complete> finish();

 private:
  MeshUpload() = default;

  std::string name_;
  std::optional<Sha256> announced_;
  size_t vertex_numbers_ = 0;  // announced length of the column `vertices`, three numbers a vertex
  size_t index_numbers_ = 0;   // announced length of the column `indices`, three numbers a triangle
  std::vector<MeshPart> parts_;
  std::vector<float> vertices_;
  std::vector<uint32_t> indices_;
};

// Serves one UploadMesh call. Blocks for the caller's messages and for the build of the tree.
absl::Status upload_mesh(Host& host, const Caller& caller, grpc::ServerReader<v1::UploadMeshRequest>& reader,
                         v1::UploadMeshResponse* response);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_MESH_UPLOAD_H_
