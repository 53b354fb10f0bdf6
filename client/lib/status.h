// From the wire's errors to absl::Status and back to the server's structured refusal. For callers that want to act on a
// reason, a field or a limit instead of reading the message. Functions without state.
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

// What the server said about a refusal. Nothing where the server did not speak: no connection, the deadline, a proxy.
std::optional<v1::Error> error_of(const absl::Status& status);

// The wait the server asked for before the same request is sent again; zero where it did not ask for any.
absl::Duration retry_after(const absl::Status& status);

// True where the server refused, so that nothing was changed; false also where the outcome is unknown.
bool refused_by_server(const absl::Status& status);

// Code and message as they are, with the Error that travels in `grpc-status-details-bin` attached for error_of().
// Malformed details are left out: the code and the message still hold.
absl::Status to_absl_status(const grpc::Status& status);

// A refusal that a stream reported under a sequence number. A code that no refusal has (0, or no gRPC code) becomes
// UNKNOWN, so that a refusal never turns into success.
absl::Status to_absl_status(const v1::Error& error);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_STATUS_H_
