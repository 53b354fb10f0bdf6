#include "server/services/sha256.h"

#include <array>
#include <bit>

namespace locus::server {

static_assert(std::endian::native == std::endian::little, "columns are hashed as they lie in memory");

Sha256Hasher::Sha256Hasher()
    : context_(EVP_MD_CTX_new(), &EVP_MD_CTX_free),
      good_(context_ != nullptr && EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) == 1) {}

void Sha256Hasher::add(const void* data, size_t bytes) {
  good_ = good_ && EVP_DigestUpdate(context_.get(), data, bytes) == 1;
}

absl::StatusOr<Sha256> Sha256Hasher::finish() {
  Sha256 hash{};
  unsigned length = 0;
  if (good_ && EVP_DigestFinal_ex(context_.get(), hash.data(), &length) == 1 && length == hash.size()) return hash;
  return absl::InternalError("OpenSSL could not compute a SHA-256; check its configuration");
}

absl::StatusOr<Sha256> mesh_hash(absl::Span<const float> vertices, absl::Span<const uint32_t> indices) {
  const std::array<uint32_t, 2> counts = {static_cast<uint32_t>(vertices.size() / 3),
                                          static_cast<uint32_t>(indices.size() / 3)};
  Sha256Hasher hasher;
  hasher.add(counts.data(), sizeof counts);
  hasher.add(vertices.data(), vertices.size() * sizeof(float));
  hasher.add(indices.data(), indices.size() * sizeof(uint32_t));
  return hasher.finish();
}

}  // namespace locus::server
