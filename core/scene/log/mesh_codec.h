// Encodes the columns of a mesh, and the parts of one name, as chunks for the log, and decodes them. The tree is not
// included: its topology is cached separately by tree_codec.h. One thread at a time.
#ifndef LOCUS_CORE_SCENE_LOG_MESH_CODEC_H_
#define LOCUS_CORE_SCENE_LOG_MESH_CODEC_H_

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/mesh/triangle_mesh.h"
#include "core/scene/log/byte_codec.h"
#include "core/scene/statics/static_mesh.h"

namespace locus {

class MeshWriter {
 public:
  // Unpacks all vertices now, and everything else one chunk at a time.
  explicit MeshWriter(std::shared_ptr<const StaticMesh> mesh);

  // Returns the next chunk, at most UpdateLog::kMaxChunkBytes, or nullopt at the end. Suitable as a ChunkSource.
  absl::StatusOr<std::optional<std::string>> next();

 private:
  std::string header() const;
  std::string next_vertices();
  std::string next_indices();

  const std::shared_ptr<const StaticMesh> mesh_;
  const std::vector<float> vertices_;
  PackedIndices::Reader indices_;
  bool begun_ = false;
  size_t next_vertex_ = 0;  // index of a coordinate in vertices_
  size_t next_index_ = 0;
};

// Writes the parts of one name: a header that says how many there are, then the parts.
class PartsWriter {
 public:
  explicit PartsWriter(std::shared_ptr<const StaticMesh> mesh) : mesh_(std::move(mesh)) {}

  // Returns the next chunk, as MeshWriter::next() does.
  absl::StatusOr<std::optional<std::string>> next();

 private:
  const std::shared_ptr<const StaticMesh> mesh_;
  bool begun_ = false;
  size_t next_part_ = 0;
};

// Reads what MeshWriter wrote, and meshes of format 1, whose parts stand with the columns.
class MeshReader {
 public:
  // Reads the next chunk, in the order in which they were written. DATA_LOSS describes damage.
  absl::Status add(absl::string_view chunk);
  // Makes the mesh after all chunks were added. DATA_LOSS if chunks are missing or the mesh is not valid.
  absl::StatusOr<TriangleMesh> finish() &&;

 private:
  void read_header(ByteReader& reader);

  bool begun_ = false;
  uint64_t vertex_numbers_ = 0;  // expected counts, from the header
  uint64_t index_numbers_ = 0;
  uint64_t part_count_ = 0;
  std::vector<float> vertices_;
  std::vector<uint32_t> indices_;
  std::vector<MeshPart> parts_;
};

// Reads what PartsWriter wrote.
class PartsReader {
 public:
  // Takes the next chunk, as MeshReader::add() does.
  absl::Status add(absl::string_view chunk);
  // Returns the parts once all chunks came. DATA_LOSS where they do not fit a mesh of `triangles` triangles.
  absl::StatusOr<std::vector<MeshPart>> finish(size_t triangles) &&;

 private:
  bool begun_ = false;
  uint64_t part_count_ = 0;  // how many there are to be
  std::vector<MeshPart> parts_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_MESH_CODEC_H_
