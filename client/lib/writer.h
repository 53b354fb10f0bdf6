// Writer ids and batch numbers of streams that update a scene. Internal to the library. No state; any thread.
#ifndef LOCUS_CLIENT_LIB_WRITER_H_
#define LOCUS_CLIENT_LIB_WRITER_H_

#include <cstdint>
#include <optional>
#include <random>

#include "absl/status/status.h"
#include "client/lib/status.h"
#include "locus/v1/errors.pb.h"

namespace locus::client {

// Returns a random writer id, which is not 0.
inline uint64_t random_writer() {
  std::random_device device;
  uint64_t writer = 0;
  while (writer == 0) writer = (uint64_t{device()} << 32) | device();
  return writer;
}

// Returns whether the batch number of a failed batch can be used again: true if the server refused the batch with any
// reason except REASON_BATCH_GAP. That reason means that the server has lost the state of the writer. After an error
// without a reason it is unknown whether the server used the number, and continuing could lose a batch silently.
inline bool batch_number_is_unused(const absl::Status& failure) {
  const std::optional<v1::Error> error = error_of(failure);
  return error && error->reason() != v1::REASON_UNSPECIFIED && error->reason() != v1::REASON_BATCH_GAP;
}

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_WRITER_H_
