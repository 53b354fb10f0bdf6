// Options of connections, deadlines and retries. For callers of Client::connect and the streams. Plain data.
#ifndef LOCUS_CLIENT_LIB_OPTIONS_H_
#define LOCUS_CLIENT_LIB_OPTIONS_H_

#include "absl/time/time.h"

namespace locus::client {

// Number of attempts and waits between them. The wait doubles with each attempt and varies randomly by up to 20 %, so
// that many clients of one server do not retry in step. If the server requests a longer wait (Error.retry_after_ms),
// that wait is used instead.
struct RetryPolicy {
  // Maximum number of attempts, including the first. 1 = no retries.
  int max_attempts = 5;
  // Wait before the second attempt.
  absl::Duration first_backoff = absl::Milliseconds(100);
  // Maximum wait before its random variation, unless the server requests a longer one.
  absl::Duration max_backoff = absl::Seconds(2);
};

// One of a client's two connections. A connection is one socket, on which small messages wait behind large ones.
enum class Lane {
  kLatency,  // small messages with low latency: unary calls, and streams of small batches
  kBulk,     // large messages: streams by default, uploads, downloads, dumps, backups
};

struct ClientOptions {
  // Maximum duration of connect().
  absl::Duration connect_timeout = absl::Seconds(10);
  // False: connect() fails as soon as an attempt is refused, so that a wrong address is reported at once. True: it
  // retries until the timeout, for servers that are just starting.
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
  // Retries of calls that change nothing, and of updates that carry `writer` and `batch`. No other call is ever
  // retried.
  RetryPolicy retry;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_OPTIONS_H_
