#include "client/cli/backup/checksums.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "client/lib/backup.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr size_t kHexDigits = 64;
constexpr absl::string_view kBetween = "  ";
constexpr size_t kShownPathBytes = 200;  // maximum length of a path in a message

bool is_hex_digit(char c) { return absl::ascii_isdigit(static_cast<unsigned char>(c)) || (c >= 'a' && c <= 'f'); }

absl::Status damaged(size_t line, absl::string_view what) {
  return absl::DataLossError(absl::StrCat("line ", line, " of ", kChecksumFile, " is damaged: ", what));
}

absl::StatusOr<Checksum> parse_line(absl::string_view line, size_t number) {
  const absl::string_view hex = line.substr(0, kHexDigits);
  if (hex.size() < kHexDigits || !std::all_of(hex.begin(), hex.end(), is_hex_digit) ||
      line.substr(kHexDigits, kBetween.size()) != kBetween)
    return damaged(number, "it is not 64 hexadecimal digits, two spaces and a path");
  Checksum checksum{.path = std::string(line.substr(kHexDigits + kBetween.size()))};
  const std::string bytes = absl::HexStringToBytes(hex);
  std::transform(bytes.begin(), bytes.end(), checksum.sha256.begin(),
                 [](char byte) { return static_cast<uint8_t>(byte); });
  return checksum;
}

}  // namespace

std::string checksum_text(const std::vector<Checksum>& checksums) {
  std::string text;
  for (const Checksum& one : checksums) {
    const absl::string_view bytes(reinterpret_cast<const char*>(one.sha256.data()), one.sha256.size());
    absl::StrAppend(&text, absl::BytesToHexString(bytes), kBetween, one.path, "\n");
  }
  return text;
}

absl::StatusOr<std::vector<Checksum>> parse_checksums(absl::string_view text) {
  std::vector<Checksum> checksums;
  client::BackupPaths paths;
  for (size_t line = 1; !text.empty(); ++line) {
    const size_t end = text.find('\n');
    if (end == absl::string_view::npos) return damaged(line, "it does not end");
    ASSIGN_OR_RETURN(Checksum one, parse_line(text.substr(0, end), line));
    if (absl::Status fit = paths.add(one.path); !fit.ok()) {
      const std::string shown = absl::CEscape(one.path.substr(0, kShownPathBytes));
      return damaged(line, absl::StrCat("the path \"", shown, "\" ", fit.message()));
    }
    checksums.push_back(std::move(one));
    text.remove_prefix(end + 1);
  }
  return checksums;
}

}  // namespace locus::cli
