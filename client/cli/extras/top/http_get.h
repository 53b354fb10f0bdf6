// One page of an HTTP port, fetched within bounds. The only place that knows libcurl. Functions without state, for one
// thread at a time.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TOP_HTTP_GET_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TOP_HTTP_GET_H_

#include <chrono>
#include <cstddef>
#include <string>

#include "absl/status/statusor.h"

namespace locus::cli {

inline constexpr size_t kMaxPageBytes = 16u << 20;

// The body of http://`address``path`, `address` as host:port. Follows no redirection and asks no proxy. UNAVAILABLE
// where nobody answers within `timeout`, FAILED_PRECONDITION for an answer other than 200, RESOURCE_EXHAUSTED for one
// beyond kMaxPageBytes, INVALID_ARGUMENT for an address that is none.
absl::StatusOr<std::string> http_get(const std::string& address, const std::string& path,
                                     std::chrono::milliseconds timeout);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TOP_HTTP_GET_H_
