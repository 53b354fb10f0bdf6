#include "client/lib/authorization.h"

#include <arpa/inet.h>
#include <sys/stat.h>

#include <algorithm>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/lib/pem_file.h"
#include "core/base/status_macros.h"
#include "grpcpp/client_context.h"

namespace locus::client {
namespace {

// Checks the form of a token. `origin` names the token's source in error messages.
absl::Status check_token(absl::string_view origin, absl::string_view token) {
  if (token.empty()) return absl::InvalidArgumentError(absl::StrCat(origin, " is empty"));
  if (token.size() > kMaxTokenBytes)
    return absl::InvalidArgumentError(absl::StrCat(origin, " is longer than ", kMaxTokenBytes, " bytes"));
  if (!std::all_of(token.begin(), token.end(), absl::ascii_isgraph))
    return absl::InvalidArgumentError(absl::StrCat(origin, " is no token: a token is one word of ASCII characters"));
  return absl::OkStatus();
}

absl::StatusOr<std::string> read_token(const std::string& file) {
  ASSIGN_OR_RETURN(const std::string text, read_small_file("token_file", file));
  const absl::string_view token = absl::StripAsciiWhitespace(text);
  RETURN_IF_ERROR(check_token(absl::StrCat("the content of ", file), token));
  return std::string(token);
}

}  // namespace

bool uses_tls(const CredentialOptions& options) {
  return options.tls || !options.ca_file.empty() || !options.certificate_file.empty() || !options.server_name.empty();
}

bool stays_on_this_machine(absl::string_view target) {
  if (absl::StartsWith(target, "unix:")) return true;
  const std::string host(target.substr(0, target.rfind(':')));
  in_addr address{};
  if (inet_pton(AF_INET, host.c_str(), &address) == 1) return (ntohl(address.s_addr) >> 24) == 127;
  return host == "localhost" || host == "[::1]";
}

absl::StatusOr<std::shared_ptr<Authorization>> Authorization::make(const CredentialOptions& options,
                                                                   const std::string& target) {
  if (!options.token.empty() && !options.token_file.empty())
    return absl::InvalidArgumentError("there are two tokens: give token or token_file, not both");
  std::shared_ptr<Authorization> made(new Authorization(options.token_file));
  if (options.token.empty() && options.token_file.empty()) return made;
  if (!uses_tls(options) && !stays_on_this_machine(target) && !options.allow_token_without_tls) {
    return absl::FailedPreconditionError(
        absl::StrCat("without TLS everyone on the way to ", target, " could read the token: connect with TLS"));
  }
  if (options.token_file.empty()) {
    RETURN_IF_ERROR(check_token("the token", options.token));
    made->token_ = options.token;
  } else {
    made->stamp_ = stamp_of(options.token_file);
    ASSIGN_OR_RETURN(made->token_, read_token(options.token_file));
  }
  return made;
}

std::shared_ptr<Authorization> Authorization::none() { return std::shared_ptr<Authorization>(new Authorization("")); }

uint64_t Authorization::add_to(grpc::ClientContext& context) {
  std::lock_guard lock(mutex_);
  if (!file_.empty() && !(stamp_of(file_) == stamp_)) read().IgnoreError();
  if (!token_.empty()) context.AddMetadata("authorization", absl::StrCat("Bearer ", token_));
  return number_;
}

std::string Authorization::header() {
  std::lock_guard lock(mutex_);
  return token_.empty() ? "" : absl::StrCat("Bearer ", token_);
}

bool Authorization::has_newer(uint64_t used) {
  std::lock_guard lock(mutex_);
  if (!file_.empty()) read().IgnoreError();
  return number_ > used;
}

Authorization::Stamp Authorization::stamp_of(const std::string& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return {};
  return {status.st_ino, status.st_size, status.st_mtim.tv_sec, status.st_mtim.tv_nsec};
}

// Reads the token file. Takes the file's stamp before it reads the content: if the file changes between these two
// steps, the stored stamp is outdated, so the next call reads the file again. Precondition: the caller holds the lock.
absl::Status Authorization::read() {
  stamp_ = stamp_of(file_);
  ASSIGN_OR_RETURN(std::string token, read_token(file_));
  if (token == token_) return absl::OkStatus();
  token_ = std::move(token);
  ++number_;
  return absl::OkStatus();
}

}  // namespace locus::client
