// HTTP requests to a port of this machine, for tests: by libcurl, or as raw bytes.
#ifndef LOCUS_TESTS_SUPPORT_HTTP_GET_H_
#define LOCUS_TESTS_SUPPORT_HTTP_GET_H_

#include <arpa/inet.h>
#include <curl/curl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <memory>
#include <string>

namespace locus::test {

struct HttpAnswer {
  long code = 0;  // HTTP status code; 0 if there was no response
  std::string headers;
  std::string body;
};

inline size_t append_to(char* data, size_t size, size_t count, void* text) {
  static_cast<std::string*>(text)->append(data, size * count);
  return size * count;
}

// Credentials of a reader.
struct HttpReader {
  std::string authorization = {};  // value of the header; empty = none
  std::string ca_file = {};        // empty = no TLS
  std::string certificate_file = {};
  std::string key_file = {};
};

// Sends a request without a body. `method` can be any method of HTTP, such as GET or HEAD.
inline HttpAnswer http_get(int port, const std::string& path, const std::string& method = "GET",
                           const HttpReader& reader = {}) {
  const std::unique_ptr<CURL, decltype(&curl_easy_cleanup)> curl(curl_easy_init(), curl_easy_cleanup);
  HttpAnswer answer;
  const std::string url =
      (reader.ca_file.empty() ? "http" : "https") + std::string("://127.0.0.1:") + std::to_string(port) + path;
  curl_easy_setopt(curl.get(), CURLOPT_URL, url.c_str());
  curl_easy_setopt(curl.get(), CURLOPT_PROXY, "");
  curl_easy_setopt(curl.get(), CURLOPT_TIMEOUT_MS, 60'000L);
  curl_easy_setopt(curl.get(), CURLOPT_NOBODY, method == "HEAD" ? 1L : 0L);
  if (method != "GET" && method != "HEAD") curl_easy_setopt(curl.get(), CURLOPT_CUSTOMREQUEST, method.c_str());
  curl_easy_setopt(curl.get(), CURLOPT_WRITEFUNCTION, append_to);
  curl_easy_setopt(curl.get(), CURLOPT_WRITEDATA, &answer.body);
  curl_easy_setopt(curl.get(), CURLOPT_HEADERFUNCTION, append_to);
  curl_easy_setopt(curl.get(), CURLOPT_HEADERDATA, &answer.headers);
  curl_slist* headers = nullptr;
  if (!reader.authorization.empty())
    headers = curl_slist_append(headers, ("Authorization: " + reader.authorization).c_str());
  const std::unique_ptr<curl_slist, decltype(&curl_slist_free_all)> owned(headers, curl_slist_free_all);
  curl_easy_setopt(curl.get(), CURLOPT_HTTPHEADER, headers);
  if (!reader.ca_file.empty()) curl_easy_setopt(curl.get(), CURLOPT_CAINFO, reader.ca_file.c_str());
  if (!reader.certificate_file.empty()) {
    curl_easy_setopt(curl.get(), CURLOPT_SSLCERT, reader.certificate_file.c_str());
    curl_easy_setopt(curl.get(), CURLOPT_SSLKEY, reader.key_file.c_str());
  }
  if (curl_easy_perform(curl.get()) == CURLE_OK) curl_easy_getinfo(curl.get(), CURLINFO_RESPONSE_CODE, &answer.code);
  return answer;
}

// A TCP connection that sends `bytes` and nothing more.
class RawConnection {
 public:
  RawConnection(int port, const std::string& bytes) : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
  }
  ~RawConnection() { close(fd_); }
  RawConnection(const RawConnection&) = delete;
  RawConnection& operator=(const RawConnection&) = delete;

  // Reads until the peer closes the connection.
  std::string read_all() {
    std::string text;
    char buffer[4096];
    for (ssize_t got = recv(fd_, buffer, sizeof buffer, 0); got > 0; got = recv(fd_, buffer, sizeof buffer, 0))
      text.append(buffer, static_cast<size_t>(got));
    return text;
  }

 private:
  int fd_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_HTTP_GET_H_
