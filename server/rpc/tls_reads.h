// Checks of the bytes that gRPC reads from TLS connections, and counts of failed handshakes. read_hooks.cc calls
// them: its functions replace recvmsg(), SSL_read() and SSL_do_handshake() for the whole process, because gRPC 1.51
// offers no hook between reading and parsing. They call the original functions, then check the frames of HTTP/2 in the
// bytes that were read. They check the sockets that a CheckedReads object watches, and every TLS connection whose
// client has agreed on a protocol with the server. If bytes are refused, the read fails, so that gRPC closes the
// connection. SSL_do_handshake() is replaced only to count failed handshakes, which gRPC reports only in its log.
// server/connections/README.md explains this decision. read_hooks.cc is linked into programs that listen on sockets, as
// the target locus_read_hooks; a server that is called only in its own process does without it.
#ifndef LOCUS_SERVER_RPC_TLS_READS_H_
#define LOCUS_SERVER_RPC_TLS_READS_H_

#include <openssl/ssl.h>

#include <cstdint>

#include "absl/strings/string_view.h"

namespace locus::server {

// Begins to check the bytes of TLS connections. `on_refused` is called on the reading thread for each read whose bytes
// are refused. Call it before the first connection; only the first call in the process has an effect. Ends the process
// if read_hooks.cc is not linked, or if gRPC would not call its functions. Any thread.
void check_tls_reads(void (*on_refused)(const char* reason));

// Counts of the TLS connections that this process has accepted as a server.
struct TlsCounts {
  uint64_t failed_handshakes = 0;
  uint64_t long_headers = 0;  // connections closed for a block of headers that was too long
  uint64_t floods = 0;        // connections closed for other reasons of FrameCheck::refusal()
};
// Returns the counts since the process started. The counts are not kept for each peer, because OpenSSL does not name
// the peer. Any thread.
TlsCounts tls_counts();

// Functions for read_hooks.cc. The first checks bytes that were read from a TLS connection, and returns false if they
// are refused. The second counts the handshake if it has failed; `result` is the result of SSL_do_handshake() for one
// step of a handshake.
bool accept_tls_read(SSL* ssl, absl::string_view bytes);
void count_handshake(SSL* ssl, int result);

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_TLS_READS_H_
