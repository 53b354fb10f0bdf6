#include "core/scene/log/mesh_codec.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/scene/log/update_log.h"

namespace locus {
namespace {

constexpr size_t kNumbersPerChunk = 3 * 65536;
static_assert(kNumbersPerChunk * sizeof(float) + 64 <= UpdateLog::kMaxChunkBytes);
// Size beyond which a chunk of parts ends.
constexpr size_t kPartsChunk = UpdateLog::kMaxChunkBytes / 2;
static_assert(kPartsChunk + limits::kMaxLabelLength + 64 <= UpdateLog::kMaxChunkBytes);
constexpr size_t kMinPart = 2 * 8;

}  // namespace

MeshWriter::MeshWriter(std::shared_ptr<const StaticMesh> mesh)
    : mesh_(std::move(mesh)), vertices_(mesh_->vertices()), indices_(mesh_->indices()) {
  LOCUS_DCHECK_EQ(vertices_.size(), size_t{3} * mesh_->vertex_count());
}

absl::StatusOr<std::optional<std::string>> MeshWriter::next() {
  std::string chunk;
  if (!std::exchange(begun_, true)) {
    chunk = header();
  } else if (next_vertex_ < vertices_.size()) {
    chunk = next_vertices();
  } else if (next_index_ < size_t{3} * mesh_->triangle_count()) {
    chunk = next_indices();
  } else if (next_part_ < mesh_->parts().size()) {
    chunk = next_parts();
  } else {
    return std::optional<std::string>();
  }
  LOCUS_CHECK_LE(chunk.size(), UpdateLog::kMaxChunkBytes);
  return std::optional<std::string>(std::move(chunk));
}

std::string MeshWriter::header() const {
  std::string chunk;
  ByteWriter writer(chunk);
  write_kind(writer, BytesKind::kMeshHeader);
  writer.number(uint64_t{vertices_.size()});
  writer.number(uint64_t{3} * mesh_->triangle_count());
  writer.number(uint64_t{mesh_->parts().size()});
  return chunk;
}

std::string MeshWriter::next_vertices() {
  std::string chunk;
  ByteWriter writer(chunk);
  write_kind(writer, BytesKind::kMeshVertices);
  const auto numbers = absl::MakeConstSpan(vertices_).subspan(next_vertex_, kNumbersPerChunk);
  writer.column(numbers);
  next_vertex_ += numbers.size();
  return chunk;
}

std::string MeshWriter::next_indices() {
  std::vector<uint32_t> numbers(std::min(kNumbersPerChunk, size_t{3} * mesh_->triangle_count() - next_index_));
  for (uint32_t& number : numbers) number = indices_.next();
  next_index_ += numbers.size();
  std::string chunk;
  ByteWriter writer(chunk);
  write_kind(writer, BytesKind::kMeshIndices);
  writer.column(absl::MakeConstSpan(numbers));
  return chunk;
}

std::string MeshWriter::next_parts() {
  std::string chunk;
  ByteWriter writer(chunk);
  write_kind(writer, BytesKind::kMeshParts);
  for (; next_part_ < mesh_->parts().size() && chunk.size() < kPartsChunk; ++next_part_) {
    const MeshPart& part = mesh_->parts()[next_part_];
    writer.number(uint64_t{part.first_triangle});
    writer.text(part.name);
  }
  return chunk;
}

absl::Status MeshReader::add(absl::string_view chunk) {
  const AlignedBytes aligned(chunk);
  ByteReader reader(aligned.bytes());
  const BytesKind kind = read_kind(reader);
  if (reader.good() && (kind == BytesKind::kMeshHeader) == begun_) reader.fail("the header", "is not first");
  if (kind == BytesKind::kMeshHeader) {
    read_header(reader);
  } else if (kind == BytesKind::kMeshVertices) {
    const auto numbers = reader.column<float>("vertices");
    vertices_.insert(vertices_.end(), numbers.begin(), numbers.end());
  } else if (kind == BytesKind::kMeshIndices) {
    const auto numbers = reader.column<uint32_t>("indices");
    indices_.insert(indices_.end(), numbers.begin(), numbers.end());
  } else if (kind == BytesKind::kMeshParts) {
    read_parts(reader);
  } else {
    reader.fail("the kind of a chunk", "is not known");
  }
  if (vertices_.size() > vertex_numbers_ || indices_.size() > index_numbers_ || parts_.size() > part_count_)
    reader.fail("a chunk", "is one too many");
  reader.end("a chunk");
  return reader.status();
}

void MeshReader::read_header(ByteReader& reader) {
  begun_ = true;
  vertex_numbers_ = reader.number_upto(uint64_t{3} * limits::kMaxMeshVertices, "the number of coordinates");
  index_numbers_ = reader.number_upto(uint64_t{3} * limits::kMaxMeshTriangles, "the number of indices");
  part_count_ = reader.number_upto(limits::kMaxMeshParts, "the number of parts");
}

void MeshReader::read_parts(ByteReader& reader) {
  while (reader.good() && reader.left() >= kMinPart) {
    MeshPart& part = parts_.emplace_back();
    part.first_triangle =
        static_cast<uint32_t>(reader.number_upto(limits::kMaxMeshTriangles, "the first triangle of a part"));
    part.name = std::string(reader.text(limits::kMaxLabelLength, "the name of a part"));
  }
}

absl::StatusOr<TriangleMesh> MeshReader::finish() && {
  if (!begun_) return data_loss("the header is not there");
  if (vertices_.size() != vertex_numbers_ || indices_.size() != index_numbers_ || parts_.size() != part_count_)
    return data_loss(absl::StrCat("of ", vertex_numbers_, " coordinates, ", index_numbers_, " indices and ",
                                  part_count_, " parts ", vertices_.size(), ", ", indices_.size(), " and ",
                                  parts_.size(), " are there"));
  absl::StatusOr<TriangleMesh> mesh =
      TriangleMesh::create(std::move(vertices_), std::move(indices_), std::move(parts_));
  if (!mesh.ok()) return data_loss(absl::StrCat("what is there is no mesh: ", mesh.status().message()));
  return mesh;
}

}  // namespace locus
