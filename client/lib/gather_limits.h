// How much is gathered into one message, and how long. For callers of QueryBatcher and MoveBatcher. Plain data.
#ifndef LOCUS_CLIENT_LIB_GATHER_LIMITS_H_
#define LOCUS_CLIENT_LIB_GATHER_LIMITS_H_

#include <cstddef>

#include "absl/time/time.h"

namespace locus::client {

struct GatherLimits {
  // Things in a message, 1 or more. A full one goes at once.
  size_t max_items = 1024;
  // Since the first thing came. 0 = as soon as the message before has gone.
  absl::Duration max_delay = absl::Microseconds(500);
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_GATHER_LIMITS_H_
