#include "core/scene/log/mesh_codec.h"

#include <gtest/gtest.h>

#include "core/scene/log/update_log.h"
#include "tests/support/damaged_bytes.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

std::vector<std::string> chunks_of(const std::shared_ptr<const StaticMesh>& mesh) {
  std::vector<std::string> chunks;
  MeshWriter writer(mesh);
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
    const auto mesh = random_mesh(random, 200'000, triangles, triangles / 40);
    const std::vector<std::string> chunks = chunks_of(mesh);
    EXPECT_LT(4u, chunks.size());
    const absl::StatusOr<TriangleMesh> again = read(chunks);
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_EQ(again->vertices(), mesh->vertices());
    std::vector<uint32_t> indices(size_t{3} * triangles);
    PackedIndices::Reader reader = mesh->indices();
    for (uint32_t& index : indices) index = reader.next();
    EXPECT_EQ(again->indices(), indices);
    ASSERT_EQ(again->parts().size(), mesh->parts().size());
    for (size_t i = 0; i < mesh->parts().size(); ++i) {
      EXPECT_EQ(again->parts()[i].name, mesh->parts()[i].name);
      EXPECT_EQ(again->parts()[i].first_triangle, mesh->parts()[i].first_triangle);
    }
  }
}

TEST(MeshCodecTest, AChunkThatIsMissingOrThereTwiceIsSeen) {
  Random random(2);
  const std::vector<std::string> chunks = chunks_of(random_mesh(random, 90, 60, 3));
  for (size_t i = 0; i < chunks.size(); ++i) {
    std::vector<std::string> fewer = chunks, more = chunks;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
    more.insert(more.begin() + static_cast<std::ptrdiff_t>(i), chunks[i]);
    EXPECT_EQ(read(fewer).status().code(), absl::StatusCode::kDataLoss) << i;
    EXPECT_EQ(read(more).status().code(), absl::StatusCode::kDataLoss) << i;
  }
  EXPECT_EQ(read({}).status(), absl::DataLossError("the header is not there"));
}

TEST(MeshCodecTest, DamagedBytesNeverHarm) {
  Random random(3);
  const std::vector<std::string> chunks = chunks_of(random_mesh(random, 90, 60, 3));
  uint64_t refused = 0;
  for (uint64_t i = 0; i < scaled_count(20000); ++i) {
    std::vector<std::string> wrong = chunks;
    std::string& chunk = wrong[random.below(wrong.size())];
    chunk = damaged(chunk, random);
    const absl::Status status = read(wrong).status();
    EXPECT_TRUE(status.ok() || absl::IsDataLoss(status)) << status;
    refused += status.ok() ? 0 : 1;
  }
  EXPECT_NE(refused, 0u);
}

}  // namespace
}  // namespace locus::test
