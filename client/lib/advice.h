// Advice for failed authentication and encryption, because gRPC's own messages for these errors suggest no remedy.
// Internal to the library. Functions without state, which any thread may call.
#ifndef LOCUS_CLIENT_LIB_ADVICE_H_
#define LOCUS_CLIENT_LIB_ADVICE_H_

#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus::client {

// Returns advice for a failed connection. `message` is gRPC's error message. The function recognizes these causes: the
// permissions of a unix socket forbid the connection, the server's name cannot be resolved, only one side uses TLS, or
// a certificate was not accepted. Returns an empty string for any other cause, for example if no server answered.
std::string advice_on_connection(absl::string_view message);

// Returns advice for an error to which the server attached no details; empty if there is no advice.
std::string advice_on(absl::StatusCode code, absl::string_view message);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_ADVICE_H_
