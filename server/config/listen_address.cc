#include "server/config/listen_address.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/base/check.h"

namespace locus::server {
namespace {

// Size of sockaddr_un::sun_path: the maximum length of a unix socket's path, including the terminating zero.
constexpr size_t kMaxUnixPath = 108;

absl::Status bad_address(absl::string_view text, absl::string_view why) {
  return absl::InvalidArgumentError(absl::StrCat("listen address `", text, "` ", why,
                                                 "; write for example 127.0.0.1:7575, [::1]:7575 or unix:/path"));
}

bool is_loopback(const std::string& host) {
  if (host == "localhost") return true;
  in_addr v4{};
  if (inet_pton(AF_INET, host.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24 == 127;
  in6_addr v6{};
  return inet_pton(AF_INET6, host.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6);
}

absl::StatusOr<ListenAddress> parse_unix(absl::string_view text, absl::string_view path) {
  if (path.empty() || path.front() != '/') return bad_address(text, "needs an absolute path");
  if (path.size() >= kMaxUnixPath) return bad_address(text, absl::StrCat("is longer than ", kMaxUnixPath - 1));
  ListenAddress address;
  address.kind = ListenAddress::Kind::kUnix;
  address.path = std::string(path);
  return address;
}

}  // namespace

absl::StatusOr<ListenAddress> parse_listen_address(absl::string_view text) {
  absl::string_view rest = text;
  if (absl::ConsumePrefix(&rest, "unix:")) return parse_unix(text, rest);
  const size_t colon = text.rfind(':');
  if (colon == absl::string_view::npos) return bad_address(text, "has no port");
  absl::string_view host = text.substr(0, colon);
  uint32_t port = 0;
  if (!absl::SimpleAtoi(text.substr(colon + 1), &port) || port > 65535)
    return bad_address(text, "has a port that is not a number in 0 .. 65535");
  if (host.size() >= 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  } else if (host.find(':') != absl::string_view::npos) {
    return bad_address(text, "needs brackets around its IPv6 address");
  }
  if (host.empty()) return bad_address(text, "has no host");
  ListenAddress address;
  address.host = std::string(host);
  address.port = static_cast<uint16_t>(port);
  address.local = is_loopback(address.host);
  return address;
}

std::string to_string(const ListenAddress& address, uint16_t port) {
  LOCUS_DCHECK_EQ(address.path.empty(), address.kind == ListenAddress::Kind::kTcp);
  if (address.kind == ListenAddress::Kind::kUnix) return absl::StrCat("unix:", address.path);
  if (address.host.find(':') != std::string::npos) return absl::StrCat("[", address.host, "]:", port);
  return absl::StrCat(address.host, ":", port);
}

absl::StatusOr<uint32_t> parse_unix_mode(absl::string_view text) {
  uint32_t mode = 0;
  bool good = text.size() == 3 || (text.size() == 4 && text.front() == '0');
  for (const char digit : text) {
    good = good && digit >= '0' && digit <= '7';
    mode = mode * 8 + static_cast<uint32_t>(digit - '0');
  }
  if (good) return mode;
  return absl::InvalidArgumentError(absl::StrCat("--unix-mode `", text, "` is not octal; write for example 0660"));
}

}  // namespace locus::server
