// A network that loses replies: a port that forwards connections to a gRPC server. On request of a test, the relay
// closes a connection after the server has processed a request and before the client receives the reply.
//
// Threads: every member may be called from any thread. Source of the frame format: RFC 9113, HTTP/2, section 4.1.
#ifndef LOCUS_TESTS_SUPPORT_LOSSY_RELAY_H_
#define LOCUS_TESTS_SUPPORT_LOSSY_RELAY_H_

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

namespace locus::test {

class LossyRelay {
 public:
  explicit LossyRelay(int server_port) : server_port_(server_port) {
    listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address = loopback(0);
    socklen_t size = sizeof(address);
    const bool listens = bind(listener_, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
                         listen(listener_, 64) == 0 &&
                         getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) == 0;
    EXPECT_TRUE(listens) << "the relay has no port";
    port_ = ntohs(address.sin_port);
    acceptor_ = std::thread([this] { accept_all(); });
  }
  ~LossyRelay() {
    ended_ = true;
    acceptor_.join();
    for (std::thread& connection : connections_) connection.join();
    close(listener_);
  }
  LossyRelay(const LossyRelay&) = delete;
  LossyRelay& operator=(const LossyRelay&) = delete;

  int port() const { return port_; }
  // Sets the port to which new connections are forwarded from now on.
  void set_server(int port) { server_port_ = port; }
  // Drops every `frames`-th DATA or HEADERS frame of the replies and closes the frame's connection; 0 drops no frame.
  void lose_every(uint64_t frames) { lose_every_ = frames; }
  // Drops only the next DATA or HEADERS frame of the replies and closes the frame's connection.
  void lose_one() { lose_one_ = true; }
  uint64_t lost() const { return lost_; }

 private:
  static constexpr int kLookMs = 20;
  static constexpr size_t kFrameHead = 9;
  static constexpr uint8_t kData = 0, kHeaders = 1;

  static sockaddr_in loopback(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<uint16_t>(port));
    return address;
  }

  void accept_all() {
    while (!ended_) {
      pollfd waiting = {listener_, POLLIN, 0};
      if (poll(&waiting, 1, kLookMs) <= 0) continue;
      const int client = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
      if (client >= 0) connections_.emplace_back([this, client] { pass_on(client); });
    }
  }

  void pass_on(int client) {
    const int server = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const sockaddr_in address = loopback(server_port_);
    if (connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0) pump(client, server);
    close(server);
    close(client);
  }

  void pump(int client, int server) {
    std::string answers;  // received part of an incomplete frame
    char bytes[65536];
    while (!ended_) {
      pollfd both[] = {{client, POLLIN, 0}, {server, POLLIN, 0}};
      if (poll(both, 2, kLookMs) <= 0) continue;
      if (both[0].revents != 0) {
        const ssize_t count = recv(client, bytes, sizeof(bytes), 0);
        if (count <= 0 || !send_all(server, bytes, static_cast<size_t>(count))) return;
      }
      if (both[1].revents != 0) {
        const ssize_t count = recv(server, bytes, sizeof(bytes), 0);
        if (count <= 0) return;
        answers.append(bytes, static_cast<size_t>(count));
        if (!pass_frames(answers, client)) return;
      }
    }
  }

  // Forwards the complete frames in `answers`. Returns false, and stops forwarding, at a frame to be dropped or if
  // sending fails.
  bool pass_frames(std::string& answers, int client) {
    while (answers.size() >= kFrameHead) {
      const auto byte = [&answers](size_t at) { return static_cast<uint8_t>(answers[at]); };
      const size_t size = kFrameHead + (size_t{byte(0)} << 16 | size_t{byte(1)} << 8 | byte(2));
      if (answers.size() < size) return true;
      if ((byte(3) == kData || byte(3) == kHeaders) && is_lost()) return false;
      if (!send_all(client, answers.data(), size)) return false;
      answers.erase(0, size);
    }
    return true;
  }

  bool is_lost() {
    const uint64_t every = lose_every_;
    const bool lose = lose_one_.exchange(false) || (every != 0 && ++answered_ % every == 0);
    lost_ += lose ? 1 : 0;
    return lose;
  }

  static bool send_all(int to, const char* bytes, size_t size) {
    while (size > 0) {
      const ssize_t sent = send(to, bytes, size, MSG_NOSIGNAL);
      if (sent <= 0) return false;
      bytes += sent;
      size -= static_cast<size_t>(sent);
    }
    return true;
  }

  std::atomic<int> server_port_;
  std::atomic<uint64_t> lose_every_ = 0, answered_ = 0, lost_ = 0;
  std::atomic<bool> lose_one_ = false, ended_ = false;
  int listener_ = -1;
  int port_ = 0;
  std::vector<std::thread> connections_;  // accessed only by acceptor_ until that thread has ended
  std::thread acceptor_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_LOSSY_RELAY_H_
