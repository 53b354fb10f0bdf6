#include "core/scene/log/mesh_codec.h"

#include <gtest/gtest.h>

#include "core/scene/log/update_log.h"
#include "tests/support/damaged_bytes.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

template <class Writer>
std::vector<std::string> chunks_of(const std::shared_ptr<const StaticMesh>& mesh) {
  std::vector<std::string> chunks;
  Writer writer(mesh);
  while (std::optional<std::string> chunk = *writer.next()) {
    EXPECT_LE(chunk->size(), UpdateLog::kMaxChunkBytes);
    chunks.push_back(*std::move(chunk));
  }
  return chunks;
}

absl::StatusOr<TriangleMesh> read(const std::vector<std::string>& chunks) {
  MeshReader reader;
  for (const std::string& chunk : chunks)
    if (absl::Status status = reader.add(chunk); !status.ok()) return status;
  return std::move(reader).finish();
}

absl::StatusOr<std::vector<MeshPart>> read_parts(const std::vector<std::string>& chunks, size_t triangles) {
  PartsReader reader;
  for (const std::string& chunk : chunks)
    if (absl::Status status = reader.add(chunk); !status.ok()) return status;
  return std::move(reader).finish(triangles);
}

// Makes a mesh with unused vertices, parts, and triangles without area.
std::shared_ptr<const StaticMesh> random_mesh(Random& random, uint32_t vertices, uint32_t triangles, size_t parts) {
  std::vector<float> numbers(size_t{3} * vertices);
  for (float& number : numbers) number = random.float_between(-100, 100);
  std::vector<uint32_t> indices(size_t{3} * triangles);
  for (uint32_t& index : indices) index = static_cast<uint32_t>(random.below(vertices));
  std::vector<MeshPart> runs;
  for (size_t i = 0; i < parts; ++i)
    runs.push_back({std::string(random.below(200), 'p'), static_cast<uint32_t>(i * triangles / parts)});
  return *StaticMesh::build("mesh", {}, *TriangleMesh::create(numbers, indices, runs));
}

TEST(MeshCodecTest, AMeshOfAnyNumberOfChunksRoundTrips) {
  Random random(1);
  for (const uint32_t triangles : {1u, 300u, 150'000u}) {
    const auto mesh = random_mesh(random, 200'000, triangles, triangles / 20);
    const std::vector<std::string> chunks = chunks_of<MeshWriter>(mesh);
    EXPECT_LE(4u, chunks.size());
    const absl::StatusOr<TriangleMesh> again = read(chunks);
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_EQ(again->vertices(), mesh->vertices());
    std::vector<uint32_t> indices(size_t{3} * triangles);
    PackedIndices::Reader reader = mesh->indices();
    for (uint32_t& index : indices) index = reader.next();
    EXPECT_EQ(again->indices(), indices);
    EXPECT_TRUE(again->parts().empty());
    const std::vector<std::string> parts = chunks_of<PartsWriter>(mesh);
    EXPECT_EQ(parts.size(), triangles == 1 ? 1u : triangles == 300 ? 2u : 3u);
    EXPECT_EQ(read_parts(parts, triangles).value(), mesh->parts());
  }
}

// In format 1, the header of a mesh's content has the number of parts, and chunks of parts follow the chunks of
// indices.
TEST(MeshCodecTest, PartsInTheContentOfFormat1AreRead) {
  Random random(4);
  const auto mesh = random_mesh(random, 90, 60, 3);
  std::vector<std::string> chunks = chunks_of<MeshWriter>(mesh);
  const std::vector<std::string> parts = chunks_of<PartsWriter>(mesh);
  chunks.front().back() = 0;
  chunks.front()[chunks.front().size() - 8] = 3;
  chunks.push_back(parts.at(1));
  const absl::StatusOr<TriangleMesh> again = read(chunks);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->parts(), mesh->parts());
}

TEST(MeshCodecTest, TheCreatorStandsWithTheParts) {
  Random random(6);
  const auto mesh = random_mesh(random, 90, 60, 3);
  const auto owned = StaticMesh::share("mesh", mesh->parts(), *mesh, "cert:game1");
  const std::vector<std::string> chunks = chunks_of<PartsWriter>(owned);
  EXPECT_EQ(chunks.size(), chunks_of<PartsWriter>(mesh).size() + 1);
  PartsReader reader;
  for (const std::string& chunk : chunks) ASSERT_TRUE(reader.add(chunk).ok());
  EXPECT_EQ(reader.creator(), "cert:game1");
  EXPECT_EQ(std::move(reader).finish(60).value(), mesh->parts());
}

TEST(MeshCodecTest, PartsThatDoNotFitTheirMeshAreDamage) {
  Random random(5);
  const std::vector<std::string> chunks = chunks_of<PartsWriter>(random_mesh(random, 90, 60, 3));
  EXPECT_TRUE(read_parts(chunks, 41).ok());
  EXPECT_EQ(read_parts(chunks, 40).status().code(), absl::StatusCode::kDataLoss);
}

TEST(MeshCodecTest, AMissingOrRepeatedChunkIsDetected) {
  Random random(2);
  const auto mesh = random_mesh(random, 90, 60, 3);
  const std::vector<std::string> chunks = chunks_of<MeshWriter>(mesh), parts = chunks_of<PartsWriter>(mesh);
  for (size_t i = 0; i < parts.size(); ++i) {
    std::vector<std::string> fewer = parts, more = parts;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
    more.insert(more.begin() + static_cast<std::ptrdiff_t>(i), parts[i]);
    EXPECT_EQ(read_parts(fewer, 60).status().code(), absl::StatusCode::kDataLoss) << i;
    EXPECT_EQ(read_parts(more, 60).status().code(), absl::StatusCode::kDataLoss) << i;
  }
  for (size_t i = 0; i < chunks.size(); ++i) {
    std::vector<std::string> fewer = chunks, more = chunks;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
    more.insert(more.begin() + static_cast<std::ptrdiff_t>(i), chunks[i]);
    EXPECT_EQ(read(fewer).status().code(), absl::StatusCode::kDataLoss) << i;
    EXPECT_EQ(read(more).status().code(), absl::StatusCode::kDataLoss) << i;
  }
  EXPECT_EQ(read({}).status(), absl::DataLossError("the header is missing"));
}

TEST(MeshCodecTest, DamagedBytesNeverHarm) {
  Random random(3);
  const auto mesh = random_mesh(random, 90, 60, 3);
  const std::vector<std::string> chunks = chunks_of<MeshWriter>(mesh), parts = chunks_of<PartsWriter>(mesh);
  uint64_t refused = 0;
  for (uint64_t i = 0; i < scaled_count(20000); ++i) {
    std::vector<std::string> wrong = chunks;
    std::string& chunk = wrong[random.below(wrong.size())];
    chunk = damaged(chunk, random);
    const absl::Status status = read(wrong).status();
    EXPECT_TRUE(status.ok() || absl::IsDataLoss(status)) << status;
    refused += status.ok() ? 0 : 1;
    wrong = parts;
    std::string& of_parts = wrong[random.below(wrong.size())];
    of_parts = damaged(of_parts, random);
    const absl::Status parts_status = read_parts(wrong, 60).status();
    EXPECT_TRUE(parts_status.ok() || absl::IsDataLoss(parts_status)) << parts_status;
  }
  EXPECT_NE(refused, 0u);
}

}  // namespace
}  // namespace locus::test
