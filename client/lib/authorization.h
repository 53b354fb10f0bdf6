// Bearer token that a client sends with its calls, and the rule that decides which connections may carry it. Internal
// to the library: callers choose the token with CredentialOptions.
#ifndef LOCUS_CLIENT_LIB_AUTHORIZATION_H_
#define LOCUS_CLIENT_LIB_AUTHORIZATION_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/lib/options.h"

namespace grpc {
class ClientContext;
}

namespace locus::client {

inline constexpr size_t kMaxTokenBytes = 8192;

// Returns whether `options` enable TLS.
bool uses_tls(const CredentialOptions& options);

// Returns whether data that is sent to the gRPC target `target` stays on this machine. True for a unix socket,
// `localhost`, an IPv4 address that begins with 127, and [::1].
bool stays_on_this_machine(absl::string_view target);

// Token of one client; empty if no token was configured. Thread-safe; streams share ownership. Invariant: a token has
// only visible ASCII characters, since gRPC aborts the process for any other character.
class Authorization {
 public:
  // Reads the token. Returns FAILED_PRECONDITION if the token may not be sent to `target` or its file cannot be read,
  // INVALID_ARGUMENT if the token is malformed or both `token` and `token_file` are set, and NOT_FOUND if the file does
  // not exist. No message contains the token.
  static absl::StatusOr<std::shared_ptr<Authorization>> make(const CredentialOptions& options,
                                                             const std::string& target);

  // Returns an Authorization without a token.
  static std::shared_ptr<Authorization> none();

  // Adds the metadata entry `authorization` to a call. Reads the token file again if the file has changed, and keeps
  // the old token if the file cannot be read. Returns the number of the token that was added; tokens are numbered 1, 2,
  // ... in the order in which they were read.
  uint64_t add_to(grpc::ClientContext& context);

  // Returns the value of the header `authorization`; empty without a token.
  std::string header();

  // Reads the token file again, after the server has refused the token numbered `used`. Returns whether a newer token
  // has been read.
  bool has_newer(uint64_t used);

 private:
  // State of a file. If two stamps of the same file differ, the file has changed.
  struct Stamp {
    uint64_t inode = 0;
    int64_t bytes = 0;
    int64_t seconds = 0;  // time of the last change
    int64_t nanoseconds = 0;
    bool operator==(const Stamp&) const = default;
  };

  explicit Authorization(std::string file) : file_(std::move(file)) {}
  static Stamp stamp_of(const std::string& file);
  absl::Status read();

  const std::string file_;  // empty = the token never changes
  std::mutex mutex_;
  Stamp stamp_;
  std::string token_;
  uint64_t number_ = 1;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_AUTHORIZATION_H_
