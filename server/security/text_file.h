// Reads the small text files of access control, and replaces them atomically. Functions without state; any thread.
#ifndef LOCUS_SERVER_SECURITY_TEXT_FILE_H_
#define LOCUS_SERVER_SECURITY_TEXT_FILE_H_

#include <sys/types.h>

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::server {

struct TextFile {
  std::string text;
  mode_t mode = 0;  // permission bits
};

// Reads a file of at most kMaxSecurityFileBytes. Returns the error of the system if it cannot be read, INVALID_ARGUMENT
// if it is larger or no regular file, and FAILED_PRECONDITION if its group or others can write it.
absl::StatusOr<TextFile> read_text_file(const std::string& file);

// Replaces a file: writes and syncs a temporary file beside it, then renames it. A reader sees either the complete old
// text or the complete new text, even after a power loss.
absl::Status replace_text_file(const std::string& file, absl::string_view text, mode_t mode);

// Returns an INVALID_ARGUMENT error about a line of a file. Its text is `FILE:LINE: message`.
absl::Status refuse_line(absl::string_view file, size_t line, absl::string_view message);

// Returns a word of a file in the form in which an error repeats it: in quotation marks, with unprintable characters
// escaped, and cut if it is long.
std::string quoted_word(absl::string_view word);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_TEXT_FILE_H_
