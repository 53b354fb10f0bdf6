// Token files of locusd: functions that make, list and revoke bearer tokens. For `locus token`. A token is `locus_`,
// its id, `_` and 43 characters: 32 random bytes in base64url. The file has one line for each token. The line contains
// the token's SHA-256 instead of the token itself. A line that begins with `#` is a comment. The form of a token's line
// is:
//   ID SHA256-HEX CREATED EXPIRES-or-never [COMMENT]
// CREATED and EXPIRES are UTC times such as 2024-05-31T12:00:00Z. An id has 1 to 63 characters (a-z, 0-9 and -) and
// does not begin or end with -. Functions without state; several processes may change one file at the same time.
#ifndef LOCUS_CLIENT_CLI_SECURITY_TOKEN_WRITER_H_
#define LOCUS_CLIENT_CLI_SECURITY_TOKEN_WRITER_H_

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

namespace locus::cli {

inline constexpr size_t kMaxTokenLines = 10'000;  // lines including comments; locusd refuses a longer file
inline constexpr size_t kMaxTokenId = 63;

// Line of a token file, without the hash.
struct TokenLine {
  std::string id;
  std::string created;
  std::string expires;  // time as text, or "never"
  std::string comment;
  bool expired = false;
};

// Parses a duration such as 12h, 30d or 8w, at most 100 years. Returns INVALID_ARGUMENT for any other text.
absl::StatusOr<absl::Duration> parse_lifetime(absl::string_view text);

// Adds a new token to the file and returns the token. If the file does not exist, it is created with mode 0600. Without
// `lifetime` the token never expires. Returns ALREADY_EXISTS if the id is listed, INVALID_ARGUMENT if the id or the
// comment is malformed, FAILED_PRECONDITION if other users may write the file or if locusd would refuse the new file.
absl::StatusOr<std::string> create_token(const std::string& file, absl::string_view id, absl::Time now,
                                         std::optional<absl::Duration> lifetime, absl::string_view comment);

// Returns the lines of all tokens in the file, in their order.
absl::StatusOr<std::vector<TokenLine>> list_tokens(const std::string& file, absl::Time now);

// Removes a token from the file. Returns NOT_FOUND if the id is not listed.
absl::Status revoke_token(const std::string& file, absl::string_view id);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SECURITY_TOKEN_WRITER_H_
