#include "server/security/audit_line.h"

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "server/security/security_limits.h"

namespace locus::server {
namespace {

constexpr uint32_t kReplacement = 0xFFFD;
constexpr uint32_t kLastCharacter = 0x10FFFF;
constexpr uint32_t kFirstSurrogate = 0xD800, kLastSurrogate = 0xDFFF, kFirstLowSurrogate = 0xDC00;
constexpr uint32_t kFirstWide = 0x10000;  // first character that needs two surrogates

// Returns the number of bytes of the UTF-8 character that begins with `first`; 0 if no character begins with this byte.
size_t length_of(uint8_t first) {
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first < 0xE0) return 2;
  if (first >= 0xE0 && first < 0xF0) return 3;
  if (first >= 0xF0 && first < 0xF5) return 4;
  return 0;
}

// Removes and returns the first character of `text`, which must not be empty; returns kReplacement for a byte that is
// not UTF-8.
uint32_t take_character(absl::string_view& text) {
  // Smallest character of each length in bytes: UTF-8 forbids encodings that are longer than necessary.
  constexpr uint32_t kSmallest[] = {0, 0, 0x80, 0x800, kFirstWide};
  const auto first = static_cast<uint8_t>(text[0]);
  const size_t length = length_of(first);
  uint32_t character = length <= 1 ? first : first & (0xFFu >> (length + 1));
  bool good = length != 0 && length <= text.size();
  for (size_t i = 1; good && i < length; ++i) {
    const auto byte = static_cast<uint8_t>(text[i]);
    good = (byte & 0xC0u) == 0x80;
    character = character << 6 | (byte & 0x3Fu);
  }
  good = good && character >= kSmallest[length] && character <= kLastCharacter &&
         !(character >= kFirstSurrogate && character <= kLastSurrogate);
  text.remove_prefix(good ? length : 1);
  return good ? character : kReplacement;
}

void append_escape(std::string& line, uint32_t unit) {
  absl::StrAppend(&line, "\\u", absl::Hex(unit, absl::kZeroPad4));
}

void append_character(std::string& line, uint32_t character) {
  if (character == '"' || character == '\\') {
    line += '\\';
    line += static_cast<char>(character);
  } else if (character >= ' ' && character < 0x7F) {
    line += static_cast<char>(character);
  } else if (character < kFirstWide) {
    append_escape(line, character);
  } else {
    append_escape(line, kFirstSurrogate + ((character - kFirstWide) >> 10));
    append_escape(line, kFirstLowSurrogate + ((character - kFirstWide) & 0x3FFu));
  }
}

std::string rfc3339(int64_t unix_ms) {
  return absl::FormatTime("%Y-%m-%dT%H:%M:%E3SZ", absl::FromUnixMillis(unix_ms), absl::UTCTimeZone());
}

}  // namespace

std::string json_string(absl::string_view text) {
  std::string line = "\"";
  while (!text.empty()) append_character(line, take_character(text));
  line += '"';
  return line;
}

std::string audit_line(const AuditEntry& entry) {
  const auto cut = [](absl::string_view text) { return json_string(text.substr(0, kMaxAuditTextBytes)); };
  return absl::StrCat(R"({"time":")", rfc3339(entry.unix_ms), R"(","principal":)", cut(entry.principal),
                      ",\"peer\":", cut(entry.peer), ",\"rpc\":", cut(entry.rpc), ",\"subject\":", cut(entry.subject),
                      ",\"code\":", json_string(absl::StatusCodeToString(entry.code))) +
         absl::StrCat(",\"request_id\":", cut(entry.request_id), ",\"text\":", cut(entry.text), "}\n");
}

}  // namespace locus::server
