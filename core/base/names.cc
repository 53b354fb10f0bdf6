#include "core/base/names.h"

#include "absl/strings/ascii.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"

namespace locus {
namespace {

bool letter_or_digit(char c) { return absl::ascii_islower(c) || absl::ascii_isdigit(c); }

}  // namespace

absl::Status check_scene_name(absl::string_view name, absl::string_view field) {
  bool good = !name.empty() && name.size() <= limits::kMaxNameLength && absl::ascii_islower(name.front()) &&
              letter_or_digit(name.back());
  for (const char c : name) good = good && (letter_or_digit(c) || c == '-' || c == '_' || c == '.');
  if (good) return absl::OkStatus();
  return refuse_argument(Reason::kMalformed, field, {},
                         "a scene's name has 1 to 63 of a-z, 0-9, -, _ and ., starts with a letter, ends with a letter "
                         "or digit");
}

absl::Status check_mesh_name(absl::string_view name, absl::string_view field) {
  bool good = !name.empty() && name.size() <= limits::kMaxNameLength;
  for (const char c : name) good = good && absl::ascii_isgraph(c);
  if (good) return absl::OkStatus();
  return refuse_argument(Reason::kMalformed, field, {}, "a mesh's name has 1 to 63 printable characters, no spaces");
}

}  // namespace locus
