// Advice for errors of identity and encryption, whose own messages suggest no remedy. Internal to the library.
// Functions without state; any thread.
#ifndef LOCUS_CLIENT_LIB_ADVICE_H_
#define LOCUS_CLIENT_LIB_ADVICE_H_

#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus::client {

// Returns advice for a connection that was not permitted or ended during its establishment: the server does not use
// TLS, requires TLS, or a certificate was not accepted. `message` is gRPC's text. Empty if no server answered or the
// cause is another one.
std::string advice_on_handshake(absl::string_view message);

// Returns advice for an error without details from the server; empty if there is no advice.
std::string advice_on(absl::StatusCode code, absl::string_view message);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_ADVICE_H_
