// A mesh ready for upload, a downloaded one, and the name of a mesh's bytes. For callers of Client::upload_mesh and
// Client::download_mesh. Plain data and one function.
#ifndef LOCUS_CLIENT_LIB_MESH_H_
#define LOCUS_CLIENT_LIB_MESH_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/types/span.h"
#include "client/lib/sha256.h"
#include "locus/v1/scene_service.pb.h"

namespace locus::client {

// Borrowed columns of a mesh.
struct MeshColumns {
  std::string name;                           // server-wide, 1 to 63 characters
  absl::Span<const float> vertices = {};      // x, y, z of each vertex
  absl::Span<const uint32_t> indices = {};    // three vertex numbers a triangle
  absl::Span<const v1::MeshPart> parts = {};  // ascending by first triangle; none = one nameless part
};

// Owned columns of a mesh as the server stores it.
struct DownloadedMesh {
  v1::Mesh description;           // without its parts
  std::vector<float> vertices;    // x, y, z of each vertex
  std::vector<uint32_t> indices;  // three vertex numbers a triangle, each below the number of vertices
  std::vector<v1::MeshPart> parts;

  // Borrowed from this, ready for upload under the same name.
  MeshColumns columns() const { return {description.name(), vertices, indices, parts}; }
};

// SHA-256 over, in this order and all little-endian: the number of vertices as uint32, the number of triangles as
// uint32, the vertices' floats, the indices as uint32. The protocol's UploadMeshRequest.sha256: equal hashes share one
// tree on the server. Linear; about 1 GB/s where the processor helps.
Sha256 mesh_sha256(absl::Span<const float> vertices, absl::Span<const uint32_t> indices);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_MESH_H_
