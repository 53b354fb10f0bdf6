#include "client/cli/security/token_writer.h"

#include <openssl/rand.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cli/security/private_file.h"
#include "client/lib/sha256.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr size_t kSecretBytes = 32;
constexpr size_t kHashDigits = 64;
constexpr char kNever[] = "never";
constexpr char kTokenTime[] = "%Y-%m-%dT%H:%M:%SZ";
constexpr char kTokenDate[] = "%Y-%m-%d";

absl::Status check_token_id(absl::string_view id) {
  const bool legal = !id.empty() && id.size() <= kMaxTokenId && id.front() != '-' && id.back() != '-' &&
                     std::all_of(id.begin(), id.end(), [](unsigned char c) {
                       return absl::ascii_islower(c) || absl::ascii_isdigit(c) || c == '-';
                     });
  return legal ? absl::OkStatus()
               : absl::InvalidArgumentError(
                     "an id of a token has 1 to 63 of a-z, 0-9 and -, and does not begin or end with -");
}

bool is_past(absl::string_view expires, absl::Time now) {
  absl::Time end;
  std::string unused;
  const bool parsed =
      absl::ParseTime(kTokenTime, expires, &end, &unused) || absl::ParseTime(kTokenDate, expires, &end, &unused);
  return parsed && now >= end;
}

// Parses a line. The error does not quote the line, because it could contain a token by mistake.
absl::StatusOr<TokenLine> parse_token_line(const std::string& file, size_t number, absl::string_view line,
                                           absl::Time now) {
  const std::vector<std::string> words = absl::StrSplit(line, absl::MaxSplits(absl::ByAnyChar(" \t"), 4));
  if (words.size() < 4 || !check_token_id(words[0]).ok() || words[1].size() != kHashDigits) {
    return absl::FailedPreconditionError(
        absl::StrCat(file, ":", number, ": is no line of a token file; locusd would not read it"));
  }
  return TokenLine{words[0], words[2], words[3], words.size() == 5 ? words[4] : "", is_past(words[3], now)};
}

absl::StatusOr<std::vector<TokenLine>> parse_tokens(const std::string& file, absl::string_view text, absl::Time now) {
  std::vector<TokenLine> lines;
  size_t number = 0;
  for (absl::string_view line : absl::StrSplit(text, '\n')) {
    ++number;
    line = absl::StripTrailingAsciiWhitespace(line);
    if (line.empty() || absl::StripLeadingAsciiWhitespace(line).front() == '#') continue;
    ASSIGN_OR_RETURN(lines.emplace_back(), parse_token_line(file, number, line, now));
  }
  if (number > kMaxTokenLines)
    return absl::FailedPreconditionError(absl::StrCat(file, " has more than ", kMaxTokenLines, " lines; remove some"));
  return lines;
}

bool has_id(const std::vector<TokenLine>& lines, absl::string_view id) {
  return std::any_of(lines.begin(), lines.end(), [&](const TokenLine& line) { return line.id == id; });
}

absl::StatusOr<SecurityFile> read_token_file(const std::string& file) {
  ASSIGN_OR_RETURN(SecurityFile content, read_security_file(file));
  if ((content.mode & 022) == 0) return content;
  return absl::FailedPreconditionError(
      absl::StrCat("users other than its owner may write ", file, " and so add tokens: chmod go-w ", file));
}

absl::StatusOr<std::string> random_token(absl::string_view id) {
  std::array<unsigned char, kSecretBytes> secret{};
  if (RAND_bytes(secret.data(), static_cast<int>(secret.size())) != 1)
    return absl::InternalError("the system gives no random numbers");
  return absl::StrCat("locus_", id, "_",
                      absl::WebSafeBase64Escape({reinterpret_cast<const char*>(secret.data()), secret.size()}));
}

std::string hash_digits(absl::string_view token) {
  client::Sha256Hasher hasher;
  hasher.add(token);
  const client::Sha256 hash = hasher.finish();
  return absl::BytesToHexString({reinterpret_cast<const char*>(hash.data()), hash.size()});
}

std::string utc_text(absl::Time time) { return absl::FormatTime(kTokenTime, time, absl::UTCTimeZone()); }

}  // namespace

absl::StatusOr<absl::Duration> parse_lifetime(absl::string_view text) {
  constexpr int64_t kMaxHours = int64_t{100} * 365 * 24;
  int64_t count = 0;
  int64_t hours = 0;
  if (!text.empty()) hours = text.back() == 'h' ? 1 : text.back() == 'd' ? 24 : text.back() == 'w' ? 7 * 24 : 0;
  const bool digits = text.size() > 1 && std::all_of(text.begin(), text.end() - 1, absl::ascii_isdigit);
  if (hours == 0 || !digits || !absl::SimpleAtoi(text.substr(0, text.size() - 1), &count) || count == 0 ||
      count > kMaxHours / hours)
    return absl::InvalidArgumentError(absl::StrCat(text, " is no lifetime: write 12h, 30d or 8w, at most 100 years"));
  return absl::Hours(count * hours);
}

absl::StatusOr<std::string> create_token(const std::string& file, absl::string_view id, absl::Time now,
                                         std::optional<absl::Duration> lifetime, absl::string_view comment) {
  RETURN_IF_ERROR(check_token_id(id));
  if (std::any_of(comment.begin(), comment.end(), [](unsigned char c) { return absl::ascii_iscntrl(c); }))
    return absl::InvalidArgumentError("a comment is one line without control characters");
  ASSIGN_OR_RETURN(const FileLock lock, FileLock::acquire(file));
  absl::StatusOr<SecurityFile> content = read_token_file(file);
  if (absl::IsNotFound(content.status())) content = SecurityFile();
  RETURN_IF_ERROR(content.status());
  ASSIGN_OR_RETURN(const std::vector<TokenLine> lines, parse_tokens(file, content->text, now));
  if (has_id(lines, id)) return absl::AlreadyExistsError(absl::StrCat(file, " already has a token ", id));
  ASSIGN_OR_RETURN(const std::string token, random_token(id));
  std::string& text = content->text;
  if (!text.empty() && text.back() != '\n') text += '\n';
  absl::StrAppend(&text, id, " ", hash_digits(token), " ", utc_text(now), " ",
                  lifetime ? utc_text(now + *lifetime) : kNever, comment.empty() ? "" : " ", comment, "\n");
  RETURN_IF_ERROR(parse_tokens(file, text, now).status());
  if (text.size() > kMaxSecurityFileBytes)
    return absl::FailedPreconditionError(absl::StrCat(file, " is full: remove some lines"));
  RETURN_IF_ERROR(replace_security_file(file, *content));
  return token;
}

absl::StatusOr<std::vector<TokenLine>> list_tokens(const std::string& file, absl::Time now) {
  ASSIGN_OR_RETURN(const SecurityFile content, read_token_file(file));
  return parse_tokens(file, content.text, now);
}

absl::Status revoke_token(const std::string& file, absl::string_view id) {
  ASSIGN_OR_RETURN(const FileLock lock, FileLock::acquire(file));
  ASSIGN_OR_RETURN(SecurityFile content, read_token_file(file));
  ASSIGN_OR_RETURN(const std::vector<TokenLine> lines, parse_tokens(file, content.text, absl::InfinitePast()));
  if (!has_id(lines, id)) return absl::NotFoundError(absl::StrCat(file, " has no token ", id));
  std::string kept;
  for (const absl::string_view line : absl::StrSplit(content.text, '\n')) {
    if (!line.empty() && line.substr(0, line.find_first_of(" \t")) != id) absl::StrAppend(&kept, line, "\n");
  }
  content.text = std::move(kept);
  return replace_security_file(file, content);
}

}  // namespace locus::cli
