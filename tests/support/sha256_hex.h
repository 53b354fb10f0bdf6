// SHA-256 of a text by a direct call of OpenSSL, so that tests check the hashes of the product without the product's
// own functions. Function without state.
#ifndef LOCUS_TESTS_SUPPORT_SHA256_HEX_H_
#define LOCUS_TESTS_SUPPORT_SHA256_HEX_H_

#include <openssl/sha.h>

#include <string>

#include "absl/strings/escaping.h"
#include "absl/strings/string_view.h"

namespace locus::test {

// Returns the SHA-256 of `bytes` in hexadecimal.
inline std::string sha256_hex(absl::string_view bytes) {
  std::string hash(SHA256_DIGEST_LENGTH, 0);
  SHA256(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(),
         reinterpret_cast<unsigned char*>(hash.data()));
  return absl::BytesToHexString(hash);
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SHA256_HEX_H_
