// Ids that name a call in logs: the request id, from the caller or generated here, and the caller's traceparent. Ids
// from a caller are untrusted input: they are validated, and an invalid id is treated as missing.
//
// Source: W3C Recommendation "Trace Context" (2021), section 3.2. Functions without state, for any thread.
#ifndef LOCUS_SERVER_OBSERVABILITY_TRACE_CONTEXT_H_
#define LOCUS_SERVER_OBSERVABILITY_TRACE_CONTEXT_H_

#include <cstdint>
#include <string>

#include "absl/strings/string_view.h"

namespace locus::server {

struct TraceContext {
  std::string request_id;
  std::string traceparent;  // empty = the caller sent no valid traceparent
};

// Returns whether `text` has 1 to kMaxRequestIdLength letters, digits and the characters . _ -
bool is_request_id(absl::string_view text);

// Returns whether `text` is version-trace-parent-flags in lower-case hexadecimal, where the version is not ff, and the
// trace and the parent are not all zeros. If the version is above 00, a hyphen and further characters may follow, up to
// 128 characters in total.
bool is_traceparent(absl::string_view text);

// Returns a number that is unique in this process. Takes a few nanoseconds.
uint64_t next_request_number();

// Returns the number as 16 hexadecimal digits that are unique in this process and, because they include a random seed,
// almost certainly different from those of other processes.
std::string request_id_of(uint64_t number);

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_TRACE_CONTEXT_H_
