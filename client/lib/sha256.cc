#include "client/lib/sha256.h"

#include <openssl/evp.h>

namespace locus::client {

struct Sha256Hasher::State {
  State() { EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr); }

  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context{EVP_MD_CTX_new(), &EVP_MD_CTX_free};
};

Sha256Hasher::Sha256Hasher() : state_(std::make_unique<State>()) {}
Sha256Hasher::~Sha256Hasher() = default;

void Sha256Hasher::add(const void* data, size_t bytes) { EVP_DigestUpdate(state_->context.get(), data, bytes); }

Sha256 Sha256Hasher::finish() {
  Sha256 hash{};
  EVP_DigestFinal_ex(state_->context.get(), hash.data(), nullptr);
  EVP_DigestInit_ex(state_->context.get(), EVP_sha256(), nullptr);
  return hash;
}

}  // namespace locus::client
