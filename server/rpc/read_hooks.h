// Replaces recvmsg() and SSL_read(), the functions with which gRPC reads from connections, for the whole process,
// because gRPC 1.51 offers no hook between reading and parsing. The replacements call the original functions, then
// check the frames of HTTP/2 in the bytes that were read. They check the sockets that a CheckedReads object watches,
// and every TLS connection whose client has agreed on a protocol with the server. If bytes are refused, the read fails,
// so that gRPC closes the connection. SSL_do_handshake() is replaced too, only to count failed handshakes, which gRPC
// reports only in its log. server/connections/README.md explains this decision.
#ifndef LOCUS_SERVER_RPC_READ_HOOKS_H_
#define LOCUS_SERVER_RPC_READ_HOOKS_H_

#include <cstdint>

namespace locus::server {

// Begins to check the bytes of TLS connections. `on_refused` is called on the reading thread for each read whose bytes
// are refused. Call it before the first connection; only the first call in the process has an effect. Any thread.
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

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_READ_HOOKS_H_
