// Conversions from gRPC errors to absl::Status, and from absl::Status to the server's structured error. For callers
// that act on a reason, a field or a limit instead of the message. The functions have no state and may be called from
// any thread.
#ifndef LOCUS_CLIENT_LIB_STATUS_H_
#define LOCUS_CLIENT_LIB_STATUS_H_

#include <optional>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "locus/v1/errors.pb.h"

namespace grpc {
class Status;
}

namespace locus::client {

// Returns the server's structured error, or nothing if the error does not come from the server, for example if there is
// no connection or the deadline has expired.
std::optional<v1::Error> error_of(const absl::Status& status);

// Returns the wait that the server requests before the same request is sent again; zero if it requests no wait.
absl::Duration retry_after(const absl::Status& status);

// Returns whether the server refused the request, so that nothing was changed. If the outcome is unknown, returns
// false.
bool refused_by_server(const absl::Status& status);

// Returns an error marked as the error of a call that only reads, so that nothing can have been changed, whatever the
// outcome. is_read_only() returns whether an error is marked. Code, message and details are kept.
absl::Status mark_read_only(absl::Status error);
bool is_read_only(const absl::Status& error);

// Converts a gRPC status: keeps code and message, and attaches the Error from `grpc-status-details-bin` for error_of().
// Malformed details are dropped; code and message remain valid. Without details, advice is appended to the message of
// UNAUTHENTICATED, of PERMISSION_DENIED, and of UNAVAILABLE if the cause of the failed connection is known.
absl::Status to_absl_status(const grpc::Status& status);

// Converts the error with which a stream answered one request. An invalid code (0, or not a gRPC code) becomes UNKNOWN,
// so that an error never turns into success.
absl::Status to_absl_status(const v1::Error& error);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_STATUS_H_
