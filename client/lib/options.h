// Options of connections, credentials, deadlines, retries and batchers. For callers of Client::connect, the streams and
// the batchers. Plain data.
#ifndef LOCUS_CLIENT_LIB_OPTIONS_H_
#define LOCUS_CLIENT_LIB_OPTIONS_H_

#include <cstddef>
#include <string>

#include "absl/time/time.h"

namespace locus::client {

// Maximum number of attempts of a call, and the waits between the attempts. The wait doubles with each attempt and
// varies randomly by up to 20 %, so that many clients of one server do not retry in step. If the server requests a
// longer wait (Error.retry_after_ms), that wait is used instead.
struct RetryPolicy {
  // Maximum number of attempts, including the first. 1 = no retries.
  int max_attempts = 5;
  // Wait before the second attempt.
  absl::Duration first_backoff = absl::Milliseconds(100);
  // Maximum of the doubled wait, to which the random variation is then applied. It does not limit a wait that the
  // server requests.
  absl::Duration max_backoff = absl::Seconds(2);
};

// One of a client's two connections. A connection is one socket, on which small messages wait behind large ones.
enum class Lane {
  kLatency,  // small messages with low latency: unary calls, and streams of small batches
  kBulk,     // large messages: streams by default, uploads, downloads, dumps, backups
};

// Servers of a cluster that answer the queries of a client. With each of them, the revisions that a client sees of a
// scene never decrease, and a query sees every update that the client was acknowledged before.
enum class ReadFrom {
  // The leader of the scene: a query also sees every update that other clients were acknowledged before it was sent.
  // Queries wait while no server leads the scene.
  kLeader,
  // The leader or a follower, chosen at random for each scene and kept while it answers. Queries continue while no
  // server leads the scene.
  kAny,
  // A follower, chosen likewise, so that the leader has time for updates; the leader if the scene has no follower.
  kFollower,
};

// Options of a client with several addresses, which replace ClientOptions::deadline and ClientOptions::retry. By
// default a call lasts longer than a takeover, in which another server becomes the leader of the scenes of a lost one
// within about 8 s.
struct ClusterOptions {
  // Servers that answer queries.
  ReadFrom read_from = ReadFrom::kLeader;
  // Maximum duration of a call including its retries.
  absl::Duration deadline = absl::Seconds(30);
  // Retries of calls, and reconnection of streams whose own policy has fewer attempts.
  RetryPolicy retry = {.max_attempts = 45, .max_backoff = absl::Milliseconds(500)};
};

// Options for the encryption of a connection, and the credentials of the client. Certificates and keys are files in PEM
// format, which connect() reads.
struct CredentialOptions {
  // Encrypts the connection with TLS. Implied by ca_file, certificate_file and server_name.
  bool tls = false;
  // File with the certificates of the authorities that may have signed the server's certificate. Empty = the
  // authorities that this machine trusts.
  std::string ca_file = {};
  // Files with the client's certificate chain and its private key, for servers that ask clients for a certificate
  // (mutual TLS). Set both options or neither.
  std::string certificate_file = {};
  std::string key_file = {};
  // Name that the server's certificate must contain. Empty = the host of the address.
  std::string server_name = {};
  // Bearer token that every call carries: the text itself (`token`) or a file that contains only the token
  // (`token_file`), not both. The file is read again when it has changed, and when the server refuses the token. A
  // unary call that was refused because of an old token is repeated with the new token.
  std::string token = {};
  std::string token_file = {};
  // True: the token may also be sent unencrypted to other machines, so everyone who can read the network traffic can
  // read the token. False: connect() returns FAILED_PRECONDITION for an address to which a token would be sent
  // unencrypted.
  bool allow_token_without_tls = false;
};

struct ClientOptions {
  // TLS, client certificate and token. Default: none of them.
  CredentialOptions credentials;
  // Maximum duration of connect().
  absl::Duration connect_timeout = absl::Seconds(10);
  // False: connect() fails as soon as one attempt to connect is refused, so that a wrong address is reported
  // immediately. True: connect() retries until connect_timeout has passed, for servers that are just starting.
  bool wait_for_server = false;
  // Maximum duration of a call including its retries. Raise it for large query batches on slow machines.
  absl::Duration deadline = absl::Seconds(10);
  // Maximum duration of calls that build or transfer much data: mesh uploads and downloads, changes of instances,
  // dumps.
  absl::Duration long_deadline = absl::Minutes(10);
  // Maximum duration of a backup, which may be as large as a disk.
  absl::Duration backup_deadline = absl::Hours(24);
  // Maximum size of a sent message in bytes. A server accepts 32 MiB by default.
  int max_send_bytes = 32 << 20;
  // Maximum size of a received message in bytes. The largest max_reply_bytes that a query may request is 64 MiB.
  int max_receive_bytes = 64 << 20;
  // Retries of unary calls that change nothing, of mesh downloads, and of updates that carry `writer` and `batch`.
  // Other calls are repeated only because of a new token (see CredentialOptions::token).
  RetryPolicy retry;
  // Options of a client with several addresses.
  ClusterOptions cluster;
};

// Limits of the number of items that a QueryBatcher or MoveBatcher gathers into one message, and of the time for which
// it gathers them.
struct GatherLimits {
  // Maximum number of items in a message, at least 1. A full message is sent immediately.
  size_t max_items = 1024;
  // Maximum time for which the first item of a message waits for more items. 0 = a message is sent as soon as the
  // previous message has been sent.
  absl::Duration max_delay = absl::Microseconds(500);
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_OPTIONS_H_
