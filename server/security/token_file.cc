#include "server/security/token_file.h"

#include <fcntl.h>
#include <openssl/crypto.h>
#include <openssl/rand.h>
#include <openssl/sha.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/time/time.h"
#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "server/security/security_limits.h"
#include "server/security/text_file.h"

namespace locus::server {
namespace {

constexpr absl::string_view kTokenStart = "locus_";
constexpr size_t kSecretBytes = 32;
constexpr size_t kSecretLength = 43;  // base64url of kSecretBytes, without padding
constexpr mode_t kTokenFileMode = 0600;
constexpr absl::string_view kNever = "never";
constexpr absl::string_view kTimeRule = "like 2024-05-31T12:00:00Z or 2024-05-31";
constexpr absl::string_view kTimeFormat = "%Y-%m-%dT%H:%M:%SZ";
constexpr absl::string_view kDateFormat = "%Y-%m-%d";

// Returns the reason why `id` is not a valid id; empty if it is valid.
absl::string_view id_mistake(absl::string_view id) {
  constexpr absl::string_view kRule = "an id has 1 to 63 of a-z, 0-9 and -, and does not begin or end with -";
  const auto good = [](char c) { return absl::ascii_islower(c) || absl::ascii_isdigit(c) || c == '-'; };
  if (id.empty() || id.size() > kMaxTokenIdLength || id.front() == '-' || id.back() == '-') return kRule;
  return std::all_of(id.begin(), id.end(), good) ? "" : kRule;
}

// Returns the id within a token; empty if the text does not have the form of a token.
absl::string_view id_of(absl::string_view token) {
  if (!absl::ConsumePrefix(&token, kTokenStart) || token.size() < kSecretLength + 2) return {};
  const size_t id_size = token.size() - kSecretLength - 1;
  const absl::string_view id = token.substr(0, id_size);
  return token[id_size] == '_' && id_mistake(id).empty() ? id : absl::string_view();
}

TokenHash hash_of(absl::string_view token) {
  TokenHash hash;
  ::SHA256(reinterpret_cast<const uint8_t*>(token.data()), token.size(), hash.data());
  return hash;
}

std::optional<int64_t> time_of(absl::string_view word) {
  absl::Time time;
  std::string error;
  for (const absl::string_view format : {kTimeFormat, kDateFormat}) {
    if (!absl::ParseTime(format, word, &time, &error)) continue;
    // Accept only the canonical form: ParseTime also accepts other widths, spaces and `infinite-future`.
    if (time != absl::InfiniteFuture() && time != absl::InfinitePast() &&
        absl::FormatTime(format, time, absl::UTCTimeZone()) == word)
      return absl::ToUnixSeconds(time);
  }
  return std::nullopt;
}

std::string time_text(int64_t seconds) {
  return absl::FormatTime(kTimeFormat, absl::FromUnixSeconds(seconds), absl::UTCTimeZone());
}

bool parse_hash(absl::string_view word, TokenHash& hash) {
  const auto hexadecimal = [](char c) { return absl::ascii_isdigit(c) || (c >= 'a' && c <= 'f'); };
  if (word.size() != 2 * hash.size() || !std::all_of(word.begin(), word.end(), hexadecimal)) return false;
  const std::string bytes = absl::HexStringToBytes(word);
  std::copy(bytes.begin(), bytes.end(), hash.begin());
  return true;
}

// Parses a line. Error texts repeat no word of the line, because a word could be a secret in the wrong place.
absl::StatusOr<TokenEntry> parse_entry(absl::string_view file, size_t number, absl::string_view line) {
  const std::vector<absl::string_view> words =
      absl::StrSplit(line, absl::MaxSplits(absl::ByAnyChar(" \t"), 4), absl::AllowEmpty());
  if (words.size() < 4) return refuse_line(file, number, "write `ID SHA256-HEX CREATED EXPIRES-or-never [COMMENT]`");
  TokenEntry entry;
  if (const absl::string_view mistake = id_mistake(words[0]); !mistake.empty())
    return refuse_line(file, number, mistake);
  entry.id = std::string(words[0]);
  if (!parse_hash(words[1], entry.hash))
    return refuse_line(file, number, "the second word is the token's SHA-256, 64 of 0-9 and a-f; never the token");
  const std::optional<int64_t> created = time_of(words[2]);
  if (!created) return refuse_line(file, number, absl::StrCat("write CREATED ", kTimeRule));
  entry.created = *created;
  if (words[3] != kNever && !(entry.expires = time_of(words[3])))
    return refuse_line(file, number, absl::StrCat("write EXPIRES ", kTimeRule, ", or `never`"));
  if (words.size() == 5) entry.comment = std::string(words[4]);
  return entry;
}

bool is_blank(absl::string_view line) {
  line = absl::StripAsciiWhitespace(line);
  return line.empty() || line.front() == '#';
}

// Returns the first word of a line.
absl::string_view first_word(absl::string_view line) { return line.substr(0, line.find_first_of(" \t")); }

bool is_expired(const TokenEntry& entry, int64_t now) {
  return entry.expires && now >= *entry.expires && !planted(PlantedBug::kTokenNeverExpires);
}

// Lock of a token file against other writers, by a lock file beside it. The destructor releases the lock; the lock file
// is never deleted.
class WriterLock {
 public:
  static absl::StatusOr<WriterLock> acquire(const std::string& file) {
    const std::string name = absl::StrCat(file, ".lock");
    WriterLock lock(::open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, kTokenFileMode));
    if (lock.descriptor_ < 0) return absl::ErrnoToStatus(errno, absl::StrCat("cannot open ", name));
    while (::flock(lock.descriptor_, LOCK_EX) != 0)
      if (errno != EINTR) return absl::ErrnoToStatus(errno, absl::StrCat("cannot lock ", name));
    return lock;
  }
  WriterLock(WriterLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  WriterLock& operator=(WriterLock&&) = delete;
  ~WriterLock() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }

 private:
  explicit WriterLock(int descriptor) : descriptor_(descriptor) {}
  int descriptor_;
};

// Reads a token file that is about to be changed. A missing file counts as empty. Refuses a file with mistakes.
absl::StatusOr<TextFile> read_to_change(const std::string& file, TokenTable& table) {
  absl::StatusOr<TextFile> read = read_text_file(file);
  if (absl::IsNotFound(read.status())) return TextFile{"", kTokenFileMode};
  RETURN_IF_ERROR(read.status());
  ASSIGN_OR_RETURN(table, TokenTable::parse(file, read->text));
  return read;
}

bool lists(const TokenTable& table, absl::string_view id) {
  return std::any_of(table.entries().begin(), table.entries().end(),
                     [&](const TokenEntry& entry) { return entry.id == id; });
}

}  // namespace

absl::StatusOr<TokenTable> TokenTable::parse(absl::string_view file, absl::string_view text) {
  if (text.size() > kMaxSecurityFileBytes)
    return refuse_line(file, 1,
                       absl::StrCat("the file is larger than ", kMaxSecurityFileBytes, " bytes; remove lines"));
  TokenTable table;
  size_t number = 0;
  for (absl::string_view line : absl::StrSplit(text, '\n')) {
    if (++number > kMaxTokens)
      return refuse_line(file, number,
                         absl::StrCat("the file has more than ", kMaxTokens, " lines; remove old tokens"));
    absl::ConsumeSuffix(&line, "\r");
    if (is_blank(line)) continue;
    ASSIGN_OR_RETURN(TokenEntry entry, parse_entry(file, number, line));
    if (!table.numbers_.emplace(entry.id, table.entries_.size()).second)
      return refuse_line(file, number, absl::StrCat("the id ", entry.id, " is listed twice; remove one line"));
    table.entries_.push_back(std::move(entry));
  }
  return table;
}

absl::StatusOr<TokenTable> TokenTable::read(const std::string& file, std::vector<std::string>& warnings) {
  ASSIGN_OR_RETURN(const TextFile read, read_text_file(file));
  if ((read.mode & S_IROTH) != 0)
    warnings.push_back(absl::StrCat(file, ": every user of this machine can read it; chmod o-r ", file));
  return parse(file, read.text);
}

const TokenEntry* TokenTable::find(absl::string_view token, int64_t now) const {
  static constexpr TokenHash kNobody{};  // compared if the id is unknown, to take as long as for a known id
  const absl::string_view id = id_of(token);
  if (id.empty()) return nullptr;
  const TokenHash hash = hash_of(token);
  const auto found = numbers_.find(id);
  const TokenEntry* const entry = found == numbers_.end() ? nullptr : &entries_[found->second];
  const size_t compared = planted(PlantedBug::kTokenByPrefix) ? 0 : hash.size();
  const bool equal = CRYPTO_memcmp((entry ? entry->hash : kNobody).data(), hash.data(), compared) == 0;
  return entry != nullptr && equal && !is_expired(*entry, now) ? entry : nullptr;
}

bool TokenTable::contains(absl::string_view id, absl::string_view hash, int64_t now) const {
  const auto found = numbers_.find(id);
  if (found == numbers_.end() || is_expired(entries_[found->second], now)) return false;
  const TokenHash& listed = entries_[found->second].hash;
  return hash == absl::string_view(reinterpret_cast<const char*>(listed.data()), listed.size());
}

bool is_token(absl::string_view bearer) { return absl::StartsWith(bearer, kTokenStart); }

std::string new_token(absl::string_view id) {
  std::string secret(kSecretBytes, '\0');
  LOCUS_CHECK_EQ(::RAND_bytes(reinterpret_cast<uint8_t*>(secret.data()), static_cast<int>(kSecretBytes)), 1);
  return absl::StrCat(kTokenStart, id, "_", absl::WebSafeBase64Escape(secret));
}

std::string token_line(const TokenEntry& entry) {
  const absl::string_view hash(reinterpret_cast<const char*>(entry.hash.data()), entry.hash.size());
  return absl::StrCat(entry.id, " ", absl::BytesToHexString(hash), " ", time_text(entry.created), " ",
                      entry.expires ? time_text(*entry.expires) : std::string(kNever), entry.comment.empty() ? "" : " ",
                      entry.comment, "\n");
}

absl::StatusOr<std::string> add_token(const std::string& file, absl::string_view id, int64_t now,
                                      std::optional<int64_t> expires, absl::string_view comment) {
  if (const absl::string_view mistake = id_mistake(id); !mistake.empty())
    return refuse_argument(Reason::kMalformed, "id", {}, absl::StrCat(mistake, ", unlike ", quoted_word(id)));
  if (std::any_of(comment.begin(), comment.end(), [](char c) { return absl::ascii_iscntrl(c); }))
    return refuse_argument(Reason::kMalformed, "comment", {}, "a comment is one line without control characters");
  ASSIGN_OR_RETURN(const WriterLock lock, WriterLock::acquire(file));
  TokenTable table;
  ASSIGN_OR_RETURN(TextFile content, read_to_change(file, table));
  if (lists(table, id)) return absl::AlreadyExistsError(absl::StrCat(file, ": the id ", id, " is listed already"));
  std::string token = new_token(id);
  if (!content.text.empty() && content.text.back() != '\n') content.text += '\n';
  absl::StrAppend(&content.text, token_line({std::string(id), hash_of(token), now, expires, std::string(comment)}));
  RETURN_IF_ERROR(TokenTable::parse(file, content.text).status());  // never write what cannot be read
  RETURN_IF_ERROR(replace_text_file(file, content.text, content.mode));
  return token;
}

absl::Status revoke_token(const std::string& file, absl::string_view id) {
  ASSIGN_OR_RETURN(const WriterLock lock, WriterLock::acquire(file));
  TokenTable table;
  ASSIGN_OR_RETURN(const TextFile content, read_to_change(file, table));
  if (!lists(table, id)) return absl::NotFoundError(absl::StrCat(file, ": there is no token ", quoted_word(id)));
  std::string kept;
  for (const absl::string_view line : absl::StrSplit(content.text, '\n'))
    if (!line.empty() && (is_blank(line) || first_word(line) != id)) absl::StrAppend(&kept, line, "\n");
  return replace_text_file(file, kept, content.mode);
}

}  // namespace locus::server
