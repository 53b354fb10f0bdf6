// Chunks of a stored mesh, of its parts and of its tree. Accepted parts are valid. If an accepted mesh or tree is
// written, read and written again, both writings have equal bytes. A tree that is restored for a mesh has the mesh's
// size and bounds.
#include <optional>

#include "core/scene/log/mesh_codec.h"
#include "core/scene/log/tree_codec.h"
#include "tests/fuzz/fuzz_target.h"

namespace locus::fuzz {
namespace {

constexpr size_t kMaxTriangles = 4096;  // keeps one input fast

using Chunks = std::vector<std::string>;

Chunks pieces_of(absl::string_view input) {
  Chunks chunks;
  while (!input.empty()) chunks.emplace_back(next_piece(input));
  return chunks;
}

absl::StatusOr<TriangleMesh> read_mesh(const Chunks& chunks) {
  MeshReader reader;
  for (const std::string& chunk : chunks)
    if (absl::Status status = reader.add(chunk); !status.ok()) return status;
  return std::move(reader).finish();
}

absl::StatusOr<std::vector<MeshPart>> read_parts(const Chunks& chunks, size_t triangles) {
  PartsReader reader;
  for (const std::string& chunk : chunks)
    if (absl::Status status = reader.add(chunk); !status.ok()) return status;
  return std::move(reader).finish(triangles);
}

template <class Writer>
Chunks chunks_of(Writer writer) {
  Chunks chunks;
  while (std::optional<std::string> chunk = *writer.next()) chunks.push_back(*std::move(chunk));
  return chunks;
}

std::shared_ptr<const StaticMesh> built(TriangleMesh mesh) {
  const auto result = StaticMesh::build("mesh", Sha256{}, std::move(mesh));
  LOCUS_CHECK(result.ok());
  return *result;
}

LOCUS_FUZZ_TARGET(mesh) {
  absl::StatusOr<TriangleMesh> mesh = read_mesh(pieces_of(input));
  if (!mesh.ok()) return check_error(mesh.status());
  if (mesh->triangle_count() > kMaxTriangles) return;
  const Chunks written = chunks_of(MeshWriter(built(*std::move(mesh))));
  absl::StatusOr<TriangleMesh> again = read_mesh(written);
  LOCUS_CHECK(again.ok());
  LOCUS_CHECK(chunks_of(MeshWriter(built(*std::move(again)))) == written);
}

LOCUS_FUZZ_TARGET(mesh_parts) {
  constexpr size_t kTriangles = 1000;
  const absl::StatusOr<std::vector<MeshPart>> parts = read_parts(pieces_of(input), kTriangles);
  if (!parts.ok()) return check_error(parts.status());
  LOCUS_CHECK(check_parts(*parts, kTriangles).ok());
}

// Returns `count` triangles in a row.
std::vector<Triangle> row_of_triangles(size_t count) {
  std::vector<Triangle> triangles;
  for (size_t i = 0; i < count; ++i) {
    const auto x = static_cast<float>(i);
    triangles.push_back({{x, 0, 0}, {x + 0.5f, 0, 0}, {x, 1, 0}});
  }
  return triangles;
}

LOCUS_FUZZ_TARGET(tree) {
  const AlignedBytes aligned(input);
  const absl::StatusOr<TreeTopology> topology = decode_topology(aligned);
  if (!topology.ok()) return check_error(topology.status());
  // The decoder accepts any padding after a column, so only the second encoding is compared.
  const std::string bytes = encode_topology(*topology);
  const absl::StatusOr<TreeTopology> again = decode_topology(AlignedBytes(bytes));
  LOCUS_CHECK(again.ok());
  LOCUS_CHECK(again->block_sizes == topology->block_sizes && again->nodes == topology->nodes);
  const size_t count = topology->numbers.size();
  if (count == 0 || count > kMaxTriangles) return;
  const std::vector<Triangle> triangles = row_of_triangles(count);
  const auto restored =
      TriangleBvh::restore(*topology, static_cast<uint32_t>(count), [&](uint32_t number) { return triangles[number]; });
  if (!restored.ok()) return check_error(restored.status());
  LOCUS_CHECK_EQ(restored->size(), count);
  LOCUS_CHECK(restored->bounds().max.x == static_cast<float>(count) - 0.5f);
  LOCUS_CHECK(encode_topology(restored->topology()) == bytes);
}

}  // namespace
}  // namespace locus::fuzz
