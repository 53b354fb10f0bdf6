// Examines the first bytes that a client sends, before gRPC gets the connection: a client of gRPC begins with the
// preface of HTTP/2 and a SETTINGS frame or, if it uses TLS, with a ClientHello. Function without state; any thread.
#ifndef LOCUS_SERVER_CONNECTIONS_FIRST_BYTES_H_
#define LOCUS_SERVER_CONNECTIONS_FIRST_BYTES_H_

#include <cstddef>
#include <cstdint>

#include "absl/strings/string_view.h"

namespace locus::server {

enum class Transport : uint8_t { kPlain, kTls };
enum class Opening : uint8_t { kIncomplete, kGood, kBad };

// Maximum number of bytes that examine_first_bytes() needs to decide.
inline constexpr size_t kFirstBytes = 33;

// Returns whether `bytes`, which are all bytes that the client has sent so far, are a valid beginning of a connection
// over `transport`; kIncomplete if more bytes are needed to decide. Source: RFC 9113, sections 3.4 and 6.5; RFC 8446,
// sections 4 and 5.1.
Opening examine_first_bytes(Transport transport, absl::string_view bytes);

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONNECTIONS_FIRST_BYTES_H_
