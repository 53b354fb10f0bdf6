#include "client/cli/levels/import/clean_text.h"

#include <cstdint>

namespace locus::cli {
namespace {

uint8_t byte_at(absl::string_view text, size_t i) { return static_cast<uint8_t>(text[i]); }

bool is_continuation(absl::string_view text, size_t i) { return i < text.size() && (byte_at(text, i) & 0xC0) == 0x80; }

// Returns the length in bytes of the UTF-8 character that begins at index `i`, or 0 if no valid character begins there.
size_t character_length(absl::string_view text, size_t i) {
  const uint8_t lead = byte_at(text, i);
  if (lead < 0x80) return 1;
  if (lead < 0xC2 || lead > 0xF4 || !is_continuation(text, i + 1)) return 0;
  if (lead < 0xE0) return 2;
  const uint8_t second = byte_at(text, i + 1);
  // Check the range of the second byte, which excludes overlong forms, surrogates and characters beyond U+10FFFF.
  if ((lead == 0xE0 && second < 0xA0) || (lead == 0xED && second > 0x9F)) return 0;
  if ((lead == 0xF0 && second < 0x90) || (lead == 0xF4 && second > 0x8F)) return 0;
  if (!is_continuation(text, i + 2)) return 0;
  if (lead < 0xF0) return 3;
  return is_continuation(text, i + 3) ? 4 : 0;
}

bool is_utf8(absl::string_view text) {
  for (size_t i = 0; i < text.size();) {
    const size_t length = character_length(text, i);
    if (length == 0) return false;
    i += length;
  }
  return true;
}

// Returns whether a control character of two bytes, U+0080 to U+009F, begins at index `i`. Terminals interpret these
// characters, too.
bool is_wide_control(absl::string_view text, size_t i) {
  return byte_at(text, i) == 0xC2 && is_continuation(text, i + 1) && byte_at(text, i + 1) < 0xA0;
}

}  // namespace

std::string clean_text(absl::string_view raw, size_t max_bytes) {
  if (raw.size() > max_bytes) {
    size_t end = max_bytes;
    while (end > 0 && is_continuation(raw, end)) --end;
    raw = raw.substr(0, end);
  }
  const bool keep_high = is_utf8(raw);
  std::string text(raw);
  for (size_t i = 0; i < text.size(); ++i) {
    const uint8_t byte = byte_at(raw, i);
    const bool wide = is_wide_control(raw, i) || (i > 0 && is_wide_control(raw, i - 1));
    if (byte < 0x20 || byte == 0x7F || wide || (byte >= 0x80 && !keep_high)) text[i] = '_';
  }
  return text;
}

}  // namespace locus::cli
