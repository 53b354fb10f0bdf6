// Limits of the number of items that a batcher gathers into one message, and of the time for which it gathers them. For
// callers of QueryBatcher and MoveBatcher. Plain data.
#ifndef LOCUS_CLIENT_LIB_GATHER_LIMITS_H_
#define LOCUS_CLIENT_LIB_GATHER_LIMITS_H_

#include <cstddef>

#include "absl/time/time.h"

namespace locus::client {

struct GatherLimits {
  // Maximum number of items in a message, at least 1. A full message is sent at once.
  size_t max_items = 1024;
  // Maximum time for which the first item of a message waits for more items. 0 = a message is sent as soon as the
  // previous message has been sent.
  absl::Duration max_delay = absl::Microseconds(500);
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_GATHER_LIMITS_H_
