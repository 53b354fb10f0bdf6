// Baseline with plain kernel sockets and the same bytes: a process that reads messages of a fixed size and answers each
// with a message of another fixed size, and clients of that process. Used by the cases that measure the cost of
// messages. One thread.
#ifndef LOCUS_TESTS_BENCH_SERVING_RAW_TCP_H_
#define LOCUS_TESTS_BENCH_SERVING_RAW_TCP_H_

#include <sys/types.h>

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "tests/bench/serving/socket_load.h"

namespace locus::bench::serving {

struct MessageBytes {
  uint32_t request = 0;
  uint32_t reply = 0;
};

class RawTcpServer {
 public:
  // Starts the server process by fork(), so it must be called while this process has one thread. The destructor ends
  // the server process.
  static absl::StatusOr<std::unique_ptr<RawTcpServer>> start();
  ~RawTcpServer();
  RawTcpServer(const RawTcpServer&) = delete;
  RawTcpServer& operator=(const RawTcpServer&) = delete;

  int port() const { return port_; }
  pid_t pid() const { return pid_; }

 private:
  RawTcpServer(pid_t pid, int port) : pid_(pid), port_(port) {}

  const pid_t pid_;
  const int port_;
};

// Clients of the server: connections, each with a thread of its own.
class RawTcpLoad {
 public:
  RawTcpLoad(const RawTcpServer& server, const MessageBytes& bytes, size_t connections, size_t window);

  // Sends `messages` messages, divided among the connections, and receives their answers.
  void run(size_t messages);
  const absl::Status& status() const { return status_; }

 private:
  const size_t window_;
  const std::string message_;
  std::vector<std::unique_ptr<SocketLoad>> connections_;
  absl::Status status_;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_RAW_TCP_H_
