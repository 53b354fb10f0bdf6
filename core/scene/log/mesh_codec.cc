#include "core/scene/log/mesh_codec.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/scene/log/update_log.h"

namespace locus {
namespace {

constexpr size_t kNumbersPerChunk = size_t{3} * 65536;  // maximum number of coordinates or vertex indices in a chunk
static_assert(kNumbersPerChunk * sizeof(float) + 64 <= UpdateLog::kMaxChunkBytes);
// Size in bytes after which no further part is added to a chunk. The last part of a chunk may exceed this size.
constexpr size_t kPartsChunk = UpdateLog::kMaxChunkBytes / 2;
static_assert(kPartsChunk + limits::kMaxLabelLength + 64 <= UpdateLog::kMaxChunkBytes);
constexpr size_t kMinPart = size_t{2} * 8;  // encoded size of a part with an empty name

// Reads the parts of one chunk and appends them to `parts`.
void read_parts(ByteReader& reader, std::vector<MeshPart>& parts) {
  while (reader.good() && reader.left() >= kMinPart) {
    MeshPart& part = parts.emplace_back();
    part.first_triangle =
        static_cast<uint32_t>(reader.number_upto(limits::kMaxMeshTriangles, "the first triangle of a part"));
    part.name = std::string(reader.text(limits::kMaxLabelLength, "the name of a part"));
  }
}

}  // namespace

std::array<float, 6> encode_bounds(const Aabbf& bounds) {
  return {bounds.min.x, bounds.min.y, bounds.min.z, bounds.max.x, bounds.max.y, bounds.max.z};
}

Aabbf decode_bounds(const float* numbers, ByteReader& reader) {
  const Aabbf bounds{{numbers[0], numbers[1], numbers[2]}, {numbers[3], numbers[4], numbers[5]}};
  if (!bounds.empty() && magnitude(bounds) <= limits::kMaxCoordinate) return bounds;
  reader.fail("the bounds of a mesh", "are out of range");
  return {};
}

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
  writer.number(uint64_t{0});  // number of parts: 0, since only data format 1 stores parts in the content
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

absl::StatusOr<std::optional<std::string>> PartsWriter::next() {
  const std::vector<MeshPart>& parts = mesh_->parts();
  std::string chunk;
  ByteWriter writer(chunk);
  if (!std::exchange(begun_, true)) {
    write_kind(writer, BytesKind::kPartsHeader);
    writer.number(uint64_t{parts.size()});
    return std::optional<std::string>(std::move(chunk));
  }
  if (!std::exchange(creator_written_, true) && !mesh_->creator().empty()) {
    write_kind(writer, BytesKind::kMeshCreator);
    writer.text(mesh_->creator());
    return std::optional<std::string>(std::move(chunk));
  }
  if (next_part_ == parts.size()) return std::optional<std::string>();
  write_kind(writer, BytesKind::kMeshParts);
  for (; next_part_ < parts.size() && chunk.size() < kPartsChunk; ++next_part_) {
    writer.number(uint64_t{parts[next_part_].first_triangle});
    writer.text(parts[next_part_].name);
  }
  LOCUS_CHECK_LE(chunk.size(), UpdateLog::kMaxChunkBytes);
  return std::optional<std::string>(std::move(chunk));
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
    read_parts(reader, parts_);
  } else {
    reader.fail("the kind of a chunk", "is not known");
  }
  if (vertices_.size() > vertex_numbers_ || indices_.size() > index_numbers_ || parts_.size() > part_count_)
    reader.fail("a chunk", "is surplus");
  reader.end("a chunk");
  return reader.status();
}

void MeshReader::read_header(ByteReader& reader) {
  begun_ = true;
  vertex_numbers_ = reader.number_upto(uint64_t{3} * limits::kMaxMeshVertices, "the number of coordinates");
  index_numbers_ = reader.number_upto(uint64_t{3} * limits::kMaxMeshTriangles, "the number of indices");
  part_count_ = reader.number_upto(limits::kMaxMeshParts, "the number of parts");
}

absl::StatusOr<TriangleMesh> MeshReader::finish() && {
  if (!begun_) return data_loss("the header is missing");
  if (vertices_.size() != vertex_numbers_ || indices_.size() != index_numbers_ || parts_.size() != part_count_)
    return data_loss(absl::StrCat("of ", vertex_numbers_, " coordinates, ", index_numbers_, " indices and ",
                                  part_count_, " parts ", vertices_.size(), ", ", indices_.size(), " and ",
                                  parts_.size(), " are there"));
  absl::StatusOr<TriangleMesh> mesh =
      TriangleMesh::create(std::move(vertices_), std::move(indices_), std::move(parts_));
  if (!mesh.ok()) return data_loss(absl::StrCat("the chunks are not a valid mesh: ", mesh.status().message()));
  return mesh;
}

absl::Status PartsReader::add(absl::string_view chunk) {
  const AlignedBytes aligned(chunk);
  ByteReader reader(aligned.bytes());
  const BytesKind kind = read_kind(reader);
  if (reader.good() && (kind == BytesKind::kPartsHeader) == begun_) reader.fail("the header of parts", "is not first");
  if (kind == BytesKind::kPartsHeader) {
    begun_ = true;
    part_count_ = reader.number_upto(limits::kMaxMeshParts, "the number of parts");
  } else if (kind == BytesKind::kMeshCreator) {
    creator_ = std::string(reader.text(limits::kMaxCreatorLength, "the creator"));
  } else if (kind == BytesKind::kMeshParts) {
    read_parts(reader, parts_);
  } else {
    reader.fail("the kind of a chunk", "is not known");
  }
  if (parts_.size() > part_count_) reader.fail("a chunk", "is surplus");
  reader.end("a chunk");
  return reader.status();
}

absl::StatusOr<std::vector<MeshPart>> PartsReader::finish(size_t triangles) && {
  if (!begun_) return data_loss("the header of parts is missing");
  if (parts_.size() != part_count_)
    return data_loss(absl::StrCat("of ", part_count_, " parts ", parts_.size(), " are there"));
  if (absl::Status status = check_parts(parts_, triangles); !status.ok())
    return data_loss(absl::StrCat("the parts do not fit the mesh: ", status.message()));
  return std::move(parts_);
}

}  // namespace locus
