// Encodes and decodes meshes as chunks for the log. Equal vertices and indices are stored once, even if several mesh
// names use them. Parts (named ranges of triangles) are stored for each name. The tree is not included: its topology is
// cached separately, see tree_codec.h. One thread at a time.
#ifndef LOCUS_CORE_SCENE_LOG_MESH_CODEC_H_
#define LOCUS_CORE_SCENE_LOG_MESH_CODEC_H_

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/geometry/aabb.h"
#include "core/mesh/triangle_mesh.h"
#include "core/scene/log/byte_codec.h"
#include "core/scene/statics/static_mesh.h"

namespace locus {

// Returns the numbers by which records and snapshots store the bounds of a mesh: minimum x y z, then maximum x y z. The
// bounds are stored with each placement, because a replay needs them to refuse the same moves of instances as before,
// and the mesh may be deleted by then.
std::array<float, 6> encode_bounds(const Aabbf& bounds);
// Returns the bounds that the 6 numbers at `numbers` encode. If no mesh has such bounds, sets the error of `reader`.
Aabbf decode_bounds(const float* numbers, ByteReader& reader);

// Encoder of the vertices and indices of a mesh.
class MeshWriter {
 public:
  // Unpacks all vertices. The indices are unpacked later, by next(), one chunk at a time.
  explicit MeshWriter(std::shared_ptr<const StaticMesh> mesh);

  // Returns the next chunk, of at most UpdateLog::kMaxChunkBytes bytes, or nullopt at the end. May be passed to
  // UpdateLog as a ChunkSource.
  absl::StatusOr<std::optional<std::string>> next();

 private:
  std::string header() const;
  std::string next_vertices();
  std::string next_indices();

  const std::shared_ptr<const StaticMesh> mesh_;
  const std::vector<float> vertices_;
  PackedIndices::Reader indices_;
  bool begun_ = false;
  size_t next_vertex_ = 0;  // index into vertices_ of the first coordinate not written yet
  size_t next_index_ = 0;   // number of vertex indices written so far
};

// Encoder of the data that is stored for one mesh name: a header with the number of parts, the creator if there is one,
// and the parts.
class PartsWriter {
 public:
  explicit PartsWriter(std::shared_ptr<const StaticMesh> mesh) : mesh_(std::move(mesh)) {}

  // Returns the next chunk, like MeshWriter::next().
  absl::StatusOr<std::optional<std::string>> next();

 private:
  const std::shared_ptr<const StaticMesh> mesh_;
  bool begun_ = false;
  bool creator_written_ = false;
  size_t next_part_ = 0;
};

// Decoder of the chunks that MeshWriter wrote, and of the chunks of data format 1, in which the content of a mesh
// includes the parts.
class MeshReader {
 public:
  // Decodes the next chunk. The chunks must be added in the order in which they were written. Returns DATA_LOSS, with a
  // description, if the chunk is damaged.
  absl::Status add(absl::string_view chunk);
  // Returns the mesh once all chunks were added. Returns DATA_LOSS if chunks are missing or the mesh is not valid.
  absl::StatusOr<TriangleMesh> finish() &&;

 private:
  void read_header(ByteReader& reader);

  bool begun_ = false;
  uint64_t vertex_numbers_ = 0;  // expected size of vertices_, from the header
  uint64_t index_numbers_ = 0;   // expected size of indices_, from the header
  uint64_t part_count_ = 0;      // expected size of parts_, from the header
  std::vector<float> vertices_;
  std::vector<uint32_t> indices_;
  std::vector<MeshPart> parts_;
};

// Decoder of the chunks that PartsWriter wrote.
class PartsReader {
 public:
  // Decodes the next chunk, like MeshReader::add().
  absl::Status add(absl::string_view chunk);
  // Returns the parts once all chunks were added. Returns DATA_LOSS if chunks are missing or the parts do not fit a
  // mesh of `triangles` triangles.
  absl::StatusOr<std::vector<MeshPart>> finish(size_t triangles) &&;
  // Returns the creator of the mesh; empty if none is stored.
  const std::string& creator() const { return creator_; }

 private:
  bool begun_ = false;
  uint64_t part_count_ = 0;  // expected size of parts_, from the header
  std::vector<MeshPart> parts_;
  std::string creator_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_MESH_CODEC_H_
