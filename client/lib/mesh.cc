#include "client/lib/mesh.h"

#include <openssl/evp.h>

#include <bit>
#include <memory>

namespace locus::client {

static_assert(std::endian::native == std::endian::little, "columns are hashed as they lie in memory");

Sha256 mesh_sha256(absl::Span<const float> vertices, absl::Span<const uint32_t> indices) {
  const std::array<uint32_t, 2> counts = {static_cast<uint32_t>(vertices.size() / 3),
                                          static_cast<uint32_t>(indices.size() / 3)};
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  Sha256 hash{};
  EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr);
  EVP_DigestUpdate(context.get(), counts.data(), sizeof(counts));
  EVP_DigestUpdate(context.get(), vertices.data(), vertices.size() * sizeof(float));
  EVP_DigestUpdate(context.get(), indices.data(), indices.size() * sizeof(uint32_t));
  EVP_DigestFinal_ex(context.get(), hash.data(), nullptr);
  return hash;
}

}  // namespace locus::client
