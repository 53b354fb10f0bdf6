// The load generator for peers with plain sockets: one connection with a window of messages in flight. A write never
// blocks while answers can be read. One thread at a time.
#ifndef LOCUS_TESTS_BENCH_SERVING_SOCKET_LOAD_H_
#define LOCUS_TESTS_BENCH_SERVING_SOCKET_LOAD_H_

#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus::bench::serving {

class SocketLoad {
 public:
  // Function that returns the length of the first answer in `received`; 0 if the answer is incomplete.
  using Whole = std::function<size_t(absl::string_view received)>;
  // Function that returns the next message, which is borrowed until it is answered; empty = there are no more.
  using Next = std::function<absl::string_view()>;
  // Function that is called with each answer, in the order of the messages.
  using Reply = std::function<void(absl::string_view reply)>;

  // Takes ownership of the connected socket.
  SocketLoad(int socket, Whole whole);
  ~SocketLoad();
  SocketLoad(const SocketLoad&) = delete;
  SocketLoad& operator=(const SocketLoad&) = delete;

  // Keeps `window` messages in flight until `next` has no more and all are answered. Returns UNAVAILABLE if the peer
  // closes the connection or sends nothing for too long.
  absl::Status run(size_t window, const Next& next, const Reply& reply);

 private:
  enum class Progress { kSome, kNone, kBroken };

  Progress write(size_t window, const Next& next);
  Progress read(const Reply& reply);
  bool wait() const;

  const int socket_;
  const Whole whole_;
  std::vector<char> buffer_;
  size_t begin_ = 0, end_ = 0;  // bounds in buffer_ of the received bytes that were not yet passed to Reply
  absl::string_view writing_;   // part of the current message that was not yet written
  size_t under_way_ = 0;
  bool more_ = false;
};

// Returns a socket connected to a port of the loopback, or to a path; -1 on failure.
int connect_to_port(int port);
int connect_to_path(const std::string& path);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_SOCKET_LOAD_H_
