#include "client/lib/mesh.h"

#include <gtest/gtest.h>

#include <vector>

#include "absl/strings/escaping.h"

namespace locus::client {
namespace {

std::string hex(const Sha256& hash) {
  return absl::BytesToHexString(absl::string_view(reinterpret_cast<const char*>(hash.data()), hash.size()));
}

// The expected hashes were computed in Python, with hashlib.sha256 over struct.pack of the counts and columns.
TEST(MeshSha256Test, CoversCountsVerticesAndIndicesInLittleEndianOrder) {
  const std::vector<float> vertices = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const std::vector<uint32_t> indices = {0, 1, 2};
  EXPECT_EQ(hex(mesh_sha256(vertices, indices)), "bbc936ee25acb1d4a2179a40a31529fccec1c4d84513c1307474c435cb64ea42");
}

TEST(MeshSha256Test, AnEmptyMeshIsTheHashOfTwoZeroCounts) {
  EXPECT_EQ(hex(mesh_sha256({}, {})), "af5570f5a1810b7af78caf4bc70a660f0df51e42baf91d4de5b2328de0e83dfc");
}

TEST(MeshSha256Test, TheBoundaryBetweenTheColumnsMatters) {
  const std::vector<float> six = {0, 0, 0, 0, 0, 0};
  const std::vector<float> three = {0, 0, 0};
  const std::vector<uint32_t> none = {};
  const std::vector<uint32_t> zeros = {0, 0, 0};
  EXPECT_NE(mesh_sha256(six, none), mesh_sha256(three, zeros));
}

}  // namespace
}  // namespace locus::client
