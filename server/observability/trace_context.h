// By which names a call is known in logs: the request id, of its caller or else made here, and the caller's
// traceparent. Both come from whoever calls, so they are checked, and what is not of their form is as if it had not
// come.
//
// Source: W3C Recommendation "Trace Context" (2021), section 3.2.
#ifndef LOCUS_SERVER_OBSERVABILITY_TRACE_CONTEXT_H_
#define LOCUS_SERVER_OBSERVABILITY_TRACE_CONTEXT_H_

#include <cstdint>
#include <string>

#include "absl/strings/string_view.h"

namespace locus::server {

struct TraceContext {
  std::string request_id;
  std::string traceparent;  // empty = none came
};

// 1 to kMaxRequestIdLength letters, digits and . _ -
bool is_request_id(absl::string_view text);

// version-trace-parent-flags in lower-case hexadecimal; not version ff, nor a trace or parent of zeros. A version after
// 00 may be followed by more, behind a hyphen, up to 128 characters.
bool is_traceparent(absl::string_view text);

// A number that no call of this process had before. Any thread, a few nanoseconds.
uint64_t next_request_number();

// 16 hexadecimal digits, which differ between processes too, with all but certainty.
std::string request_id_of(uint64_t number);

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_TRACE_CONTEXT_H_
