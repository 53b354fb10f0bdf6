#include "client/lib/mesh.h"

#include <bit>

namespace locus::client {

static_assert(std::endian::native == std::endian::little, "columns are hashed as they lie in memory");

Sha256 mesh_sha256(absl::Span<const float> vertices, absl::Span<const uint32_t> indices) {
  const std::array<uint32_t, 2> counts = {static_cast<uint32_t>(vertices.size() / 3),
                                          static_cast<uint32_t>(indices.size() / 3)};
  Sha256Hasher hasher;
  hasher.add(counts.data(), sizeof(counts));
  hasher.add(vertices.data(), vertices.size() * sizeof(float));
  hasher.add(indices.data(), indices.size() * sizeof(uint32_t));
  return hasher.finish();
}

}  // namespace locus::client
