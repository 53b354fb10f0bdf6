// SHA-256 of bytes that come piece by piece: the name of a mesh's bytes, and what proves a backup's files whole.
#ifndef LOCUS_CLIENT_LIB_SHA256_H_
#define LOCUS_CLIENT_LIB_SHA256_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "absl/strings/string_view.h"

namespace locus::client {

using Sha256 = std::array<uint8_t, 32>;

// Not thread-safe. About 1 GB/s where the processor helps.
class Sha256Hasher {
 public:
  Sha256Hasher();
  ~Sha256Hasher();
  Sha256Hasher(const Sha256Hasher&) = delete;
  Sha256Hasher& operator=(const Sha256Hasher&) = delete;

  void add(const void* data, size_t bytes);
  void add(absl::string_view bytes) { add(bytes.data(), bytes.size()); }
  // Of all that was added. From here on the hasher is as new.
  Sha256 finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_SHA256_H_
