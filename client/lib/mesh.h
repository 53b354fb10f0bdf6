// Mesh for upload, downloaded mesh, and the hash that identifies a mesh. For callers of Client::upload_mesh and
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
  std::string name;                           // unique on the server, 1 to 63 characters
  absl::Span<const float> vertices = {};      // x, y, z of each vertex
  absl::Span<const uint32_t> indices = {};    // three vertex indices per triangle
  absl::Span<const v1::MeshPart> parts = {};  // ascending by first triangle; empty = the mesh has no parts
};

// Parts in the descriptions of meshes: all parts, or none of them but their number (v1::Mesh.part_count).
enum class MeshParts : uint8_t { kAll, kNone };

// Owned columns of a mesh as the server stores it.
struct DownloadedMesh {
  v1::Mesh description;           // without its parts
  std::vector<float> vertices;    // x, y, z of each vertex
  std::vector<uint32_t> indices;  // three vertex indices per triangle, each below the number of vertices
  std::vector<v1::MeshPart> parts;

  // Returns columns that borrow from this mesh, for an upload under the same name.
  MeshColumns columns() const { return {description.name(), vertices, indices, parts}; }
};

// Returns the SHA-256 of these values in this order, all little-endian: the number of vertices as uint32, the number of
// triangles as uint32, the vertices as floats, the indices as uint32. This hash is the protocol's
// UploadMeshRequest.sha256: meshes with equal hashes share one tree on the server. Takes linear time, at about 1 GB/s
// on processors with SHA instructions.
Sha256 mesh_sha256(absl::Span<const float> vertices, absl::Span<const uint32_t> indices);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_MESH_H_
