// The load generator for peers that speak over plain sockets: one connection, so many messages under way, never blocked
// in a write while answers wait to be read. One thread at a time.
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
  // Bytes of the first answer in what has come, 0 while it is not whole.
  using Whole = std::function<size_t(absl::string_view received)>;
  // The next message, borrowed until it is answered; empty = there is no more.
  using Next = std::function<absl::string_view()>;
  // Answers come in the order of the messages.
  using Reply = std::function<void(absl::string_view reply)>;

  // Owns the connected socket.
  SocketLoad(int socket, Whole whole);
  ~SocketLoad();
  SocketLoad(const SocketLoad&) = delete;
  SocketLoad& operator=(const SocketLoad&) = delete;

  // As StreamLoad::run(). UNAVAILABLE if the peer closes the connection or keeps silent.
  absl::Status run(size_t window, const Next& next, const Reply& reply);

 private:
  enum class Progress { kSome, kNone, kBroken };

  Progress write(size_t window, const Next& next);
  Progress read(const Reply& reply);
  bool wait() const;

  const int socket_;
  const Whole whole_;
  std::vector<char> buffer_;
  size_t begin_ = 0, end_ = 0;  // of what has come and was not handed out
  absl::string_view writing_;   // the rest of the message that is being written
  size_t under_way_ = 0;
  bool more_ = false;
};

// A socket connected to a port of the loopback, or to a path; -1 if nothing answers there.
int connect_to_port(int port);
int connect_to_path(const std::string& path);

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_SOCKET_LOAD_H_
