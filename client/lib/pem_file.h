// Files with certificates and keys, checked before gRPC uses them, since gRPC reports a malformed file only in its own
// log. Internal to the library. Functions without state, which any thread may call.
#ifndef LOCUS_CLIENT_LIB_PEM_FILE_H_
#define LOCUS_CLIENT_LIB_PEM_FILE_H_

#include <cstddef>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::client {

inline constexpr size_t kMaxCredentialBytes = size_t{1} << 20;

// Choice whether read_small_file() accepts an empty file.
enum EmptyFile : bool { kMayBeEmpty = true, kMustHaveContent = false };

// Returns the content of a file with credentials or contexts. `option` names the option in messages. Returns NOT_FOUND
// if there is no such file, FAILED_PRECONDITION if the file cannot be read, and INVALID_ARGUMENT if the file is larger
// than kMaxCredentialBytes, or is empty although `empty` is kMustHaveContent.
absl::StatusOr<std::string> read_small_file(absl::string_view option, const std::string& file,
                                            EmptyFile empty = kMustHaveContent);

// Checks that the text has at least one certificate and no malformed certificate. Otherwise returns INVALID_ARGUMENT
// with the name `file` in the message.
absl::Status check_certificates(const std::string& file, absl::string_view pem);

// Checks that the text has a private key without a password, and that this key belongs to the first certificate of
// `certificates`. Otherwise returns INVALID_ARGUMENT with the name `file` in the message.
absl::Status check_key(const std::string& file, absl::string_view pem, absl::string_view certificates);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_PEM_FILE_H_
