#include "client/lib/advice.h"

#include <iterator>

#include "absl/strings/match.h"

namespace locus::client {
namespace {

// Pair of texts: if gRPC's error message for a failed connection contains `symptom`, the advice is `remedy`.
struct Advice {
  absl::string_view symptom;
  absl::string_view remedy;
};

// Advice for a connection that the server closed immediately. There are two possible causes: the server requires TLS,
// or it refused the client's certificate. The advice names both, because gRPC's message does not distinguish them. With
// TLS 1.3 a server refuses a certificate only after the client has completed its handshake.
constexpr absl::string_view kClosedAtOnce =
    "the server ended the connection at once: it may require TLS, or a client certificate that it knows";

// Advice for connections that failed. The order matters: the first entry whose symptom matches is used.
constexpr Advice kOnConnections[] = {
    {": Permission denied",
     "permission denied: the socket's file admits other users only; the server's operator can set --unix-mode and "
     "--unix-owner"},
    {"wrong version number", "the server does not use TLS: connect without it"},
    {"certificate verify failed",
     "the server's certificate does not come from a known authority, or has expired: give the CA file of the server's "
     "operator"},
    {"is not in peer certificate",
     "the server's certificate is for other names: use the name in the certificate as address or as server name"},
    {"Ssl handshake failed", "the server and this client do not agree on TLS: compare their certificates and CA files"},
    {"DNS resolution failed",
     "the name of the server is unknown here: correct it, or add it to DNS or to /etc/hosts of this machine"},
    {"failed to connect to all addresses; last error: UNAVAILABLE", kClosedAtOnce},
};

}  // namespace

std::string advice_on_connection(absl::string_view message) {
  for (const Advice& advice : kOnConnections) {
    if (absl::StrContains(message, advice.symptom)) return std::string(advice.remedy);
  }
  return "";
}

std::string advice_on(absl::StatusCode code, absl::string_view message) {
  switch (code) {
    case absl::StatusCode::kUnauthenticated:
      return "give a valid token or a client certificate";
    case absl::StatusCode::kPermissionDenied:
      return "ask the operator of the server for the right to do this";
    case absl::StatusCode::kUnavailable:
      return advice_on_connection(message);
    default:
      return "";
  }
}

}  // namespace locus::client
