// Client sockets that send arbitrary bytes, for tests of a server's treatment of connections.
#ifndef LOCUS_TESTS_SUPPORT_RAW_SOCKET_H_
#define LOCUS_TESTS_SUPPORT_RAW_SOCKET_H_

#include <arpa/inet.h>
#include <dirent.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <functional>
#include <string>
#include <thread>
#include <utility>

namespace locus::test {

// First bytes of a client of HTTP/2: the preface and an empty SETTINGS frame.
inline const std::string kHttp2Opening("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\4\0\0\0\0\0", 33);

// Returns a frame of HTTP/2. Source: RFC 9113, section 4.1.
inline std::string http2_frame(uint8_t type, uint8_t flags, uint32_t stream, const std::string& payload) {
  const auto size = static_cast<uint32_t>(payload.size());
  std::string frame;
  for (const uint32_t byte :
       {size >> 16, size >> 8, size, uint32_t{type}, uint32_t{flags}, stream >> 24, stream >> 16, stream >> 8, stream})
    frame.push_back(static_cast<char>(byte & 0xff));
  return frame + payload;
}

class RawSocket {
 public:
  // Connects to a port of 127.0.0.1, from the loopback address `from`.
  explicit RawSocket(int port, const std::string& from = "127.0.0.1") : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in own{};
    own.sin_family = AF_INET;
    inet_pton(AF_INET, from.c_str(), &own.sin_addr);
    EXPECT_EQ(bind(fd_, reinterpret_cast<const sockaddr*>(&own), sizeof own), 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  // Connects to a unix socket.
  explicit RawSocket(const std::string& path) : fd_(socket(AF_UNIX, SOCK_STREAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof(address.sun_path) - 1);
    connected_ = connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  RawSocket(RawSocket&& other) noexcept : fd_(std::exchange(other.fd_, -1)), connected_(other.connected_) {}
  ~RawSocket() {
    if (fd_ >= 0) close(fd_);
  }

  bool connected() const { return connected_; }
  int descriptor() const { return fd_; }
  // Sends all bytes. Returns false if the server has closed the connection.
  bool send(const std::string& bytes) {
    for (size_t sent = 0; sent < bytes.size();) {
      const ssize_t count = ::send(fd_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (count <= 0) return false;
      sent += static_cast<size_t>(count);
    }
    return true;
  }
  // Sends as many bytes as the socket accepts without waiting. Returns false if the server has closed the connection.
  bool send_some(const std::string& bytes) {
    const ssize_t count = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    return count > 0 || errno == EAGAIN;
  }
  // Discards the bytes received so far. Returns false if the server has closed the connection.
  bool discard() {
    char buffer[65536];
    ssize_t count = 0;
    while ((count = recv(fd_, buffer, sizeof buffer, MSG_DONTWAIT)) > 0) {
    }
    return count < 0 && errno == EAGAIN;
  }
  // Sends `bytes` and waits for any answer. Returns false if the server closes the connection, or sends nothing within
  // a minute.
  bool answers(const std::string& bytes) {
    char byte = 0;
    pollfd wait{fd_, POLLIN, 0};
    return send(bytes) && poll(&wait, 1, 60'000) == 1 && recv(fd_, &byte, 1, 0) == 1;
  }
  // Waits until the server closes the connection. Returns false if the connection is still open after a minute.
  bool wait_closed() {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    while (std::chrono::steady_clock::now() < end) {
      if (!discard()) return true;
      pollfd wait{fd_, POLLIN, 0};
      poll(&wait, 1, 100);
    }
    return false;
  }

 private:
  int fd_;
  bool connected_ = false;
};

// Waits until `condition` holds. Returns false if it still does not hold after a minute.
inline bool wait_until(const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

// Returns the number of open descriptors of this process plus a constant, for comparisons.
inline size_t open_descriptors() {
  DIR* folder = opendir("/proc/self/fd");
  size_t count = 0;
  while (readdir(folder) != nullptr) ++count;
  closedir(folder);
  return count;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_RAW_SOCKET_H_
