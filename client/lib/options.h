// What a caller may choose about connections, deadlines and retries. Plain data.
#ifndef LOCUS_CLIENT_LIB_OPTIONS_H_
#define LOCUS_CLIENT_LIB_OPTIONS_H_

#include "absl/time/time.h"

namespace locus::client {

// How often and how patiently something is tried again. The wait doubles from try to try, varied by a fifth so that
// many clients of one server do not come back in step; a server's own hint (Error.retry_after_ms) lengthens it.
struct RetryPolicy {
  // Tries in all, the first one included. 1 = never again.
  int max_attempts = 5;
  // The wait before the second try.
  absl::Duration first_backoff = absl::Milliseconds(100);
  // No wait is longer, a hint's excepted.
  absl::Duration max_backoff = absl::Seconds(2);
};

// Which of a client's two connections carries something. One connection is one socket: what is small waits there behind
// what is large.
enum class Lane {
  kLatency,  // small and soon: single calls, and streams of small batches
  kBulk,     // much at once: streams by default, uploads, downloads, dumps
};

struct ClientOptions {
  // How long connect() may take in all.
  absl::Duration connect_timeout = absl::Seconds(10);
  // False: connect() fails as soon as an attempt is refused, so that a wrong address is told at once. True: it goes on
  // trying until the timeout; for servers that are just starting.
  bool wait_for_server = false;
  // How long a call may take, its retries included. Raise it for large query batches on slow machines.
  absl::Duration deadline = absl::Seconds(10);
  // The same for calls that build or send a lot: mesh uploads, changes of instances, dumps.
  absl::Duration long_deadline = absl::Minutes(10);
  // The same for a backup, which may be as large as a disk.
  absl::Duration backup_deadline = absl::Hours(24);
  // Largest message sent; the server's default receives 32 MiB.
  int max_send_bytes = 32 << 20;
  // Largest message received; the protocol's max_reply_bytes goes up to 64 MiB.
  int max_receive_bytes = 64 << 20;
  // For calls that change nothing, and for updates that carry `writer` and `batch`. No other call is ever repeated.
  RetryPolicy retry;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_OPTIONS_H_
