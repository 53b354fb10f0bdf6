// Tokens that locusd accepts. A file lists their hashes. A token consists of `locus_`, its id, `_`, and 32 random bytes
// in 43 characters of base64url. The file has one line for each token, and `#` begins a comment line:
//   ID SHA256-HEX CREATED EXPIRES [COMMENT]
// SHA256-HEX is the hash of the whole token; CREATED and EXPIRES are UTC times, such as 2024-05-31T12:00:00Z, or dates;
// EXPIRES may also be `never`. An id has 1 to 63 characters of a-z, 0-9 and -, and begins and ends with a letter or
// digit.
//
// A table is immutable; any thread. Several processes may call the functions that change the file at the same time.
#ifndef LOCUS_SERVER_SECURITY_TOKEN_FILE_H_
#define LOCUS_SERVER_SECURITY_TOKEN_FILE_H_

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::server {

using TokenHash = std::array<uint8_t, 32>;  // SHA-256 of a whole token

struct TokenEntry {
  std::string id;
  TokenHash hash{};
  int64_t created = 0;             // seconds since 1970
  std::optional<int64_t> expires;  // first second in which the token is not valid; nullopt = never
  std::string comment;
};

class TokenTable {
 public:
  // Makes a table without tokens.
  TokenTable() = default;

  // Parses the text of a token file; `file` is its name in errors. Returns INVALID_ARGUMENT, naming the line and the
  // mistake, with advice on the correction.
  static absl::StatusOr<TokenTable> parse(absl::string_view file, absl::string_view text);
  // Reads a token file. Returns FAILED_PRECONDITION if users other than the file's owner can write it; adds a sentence
  // to `warnings` if users outside the file's group can read it.
  static absl::StatusOr<TokenTable> read(const std::string& file, std::vector<std::string>& warnings);

  // Returns the entry of a token; nullptr if the token is not listed or has expired at `now`. Takes as long for an
  // unknown id as for a known id with a wrong secret. The pointer is valid until the table is destroyed.
  const TokenEntry* find(absl::string_view token, int64_t now) const;
  // Returns whether a token with this id and hash is listed and has not expired.
  bool contains(absl::string_view id, absl::string_view hash, int64_t now) const;

  const std::vector<TokenEntry>& entries() const { return entries_; }

 private:
  std::vector<TokenEntry> entries_;
  absl::flat_hash_map<std::string, size_t> numbers_;  // positions in entries_, by id
};

// Returns whether a bearer credential begins like a token.
bool is_token(absl::string_view bearer);

// Returns a new token with the id `id` and random bytes from OpenSSL.
std::string new_token(absl::string_view id);

// Returns the line of a token file for `entry`, with the final newline.
std::string token_line(const TokenEntry& entry);

// Adds a new token to the file and returns the token. Creates the file with mode 0600 if it is missing. Returns
// ALREADY_EXISTS if the id is listed, INVALID_ARGUMENT if the id or the comment is malformed. Replaces the file
// atomically and keeps its mode.
absl::StatusOr<std::string> add_token(const std::string& file, absl::string_view id, int64_t now,
                                      std::optional<int64_t> expires, absl::string_view comment);

// Removes a token from the file. Returns NOT_FOUND if the id is not listed.
absl::Status revoke_token(const std::string& file, absl::string_view id);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_TOKEN_FILE_H_
