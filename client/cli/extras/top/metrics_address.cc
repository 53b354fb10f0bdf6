#include "client/cli/extras/top/metrics_address.h"

#include <algorithm>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace locus::cli {
namespace {

constexpr char kLoopback[] = "127.0.0.1";

// Returns the host of host:port, host, [v6]:port or [v6], in the form that stands before ":port".
std::string host_of(const std::string& address) {
  if (absl::StartsWith(address, "[")) return address.substr(0, address.find(']') + 1);
  if (std::count(address.begin(), address.end(), ':') > 1) return absl::StrCat("[", address, "]");
  return address.substr(0, address.find(':'));
}

bool is_certain(const std::string& host) {
  return !host.empty() && host != "0.0.0.0" && host != "::" && host != "localhost" && host != "::1" &&
         !absl::StartsWith(host, "127.");
}

}  // namespace

absl::StatusOr<std::string> metrics_address(const std::string& address, const v1::GetServerResponse& server) {
  if (server.http_port() == 0)
    return absl::FailedPreconditionError(
        "the server says that it has no HTTP port: start it with --http-listen, or give --metrics-address");
  std::string host = absl::StartsWith(address, "unix:") ? kLoopback : host_of(address);
  if (is_certain(server.http_host()))
    host = absl::StrContains(server.http_host(), ':') ? absl::StrCat("[", server.http_host(), "]") : server.http_host();
  return absl::StrCat(host, ":", server.http_port());
}

}  // namespace locus::cli
