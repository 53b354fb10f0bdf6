// Incremental SHA-256, for meshes and the files of a backup. The client library has a class of its own, because it is
// installed without the server's and the core's headers.
#ifndef LOCUS_SERVER_SERVICES_SHA256_H_
#define LOCUS_SERVER_SERVICES_SHA256_H_

#include <openssl/evp.h>

#include <cstddef>
#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/scene/statics/static_mesh.h"

namespace locus::server {

// SHA-256 of all bytes that were passed to add(). Only one thread at a time may use it.
class Sha256Hasher {
 public:
  Sha256Hasher();

  void add(const void* data, size_t bytes);
  // Returns the hash of all bytes added. Call it once. INTERNAL if OpenSSL failed, for example because its
  // configuration offers no SHA-256.
  absl::StatusOr<Sha256> finish();

 private:
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
  bool good_;
};

// Returns the SHA-256 of vertex count, triangle count, vertices and indices, as UploadMeshRequest.sha256 defines it.
// The lengths must be multiples of three.
absl::StatusOr<Sha256> mesh_hash(absl::Span<const float> vertices, absl::Span<const uint32_t> indices);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_SHA256_H_
