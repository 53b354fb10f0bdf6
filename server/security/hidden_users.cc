#include "server/security/hidden_users.h"

#include <cstdint>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"

namespace locus::server {
namespace {

// Number of users that are mapped if no user is hidden: all 32-bit ids except the invalid one.
constexpr uint64_t kAllUsers = 0xFFFFFFFF;

}  // namespace

bool hides_users(absl::string_view uid_map) {
  uint64_t mapped = 0;
  for (const absl::string_view line : absl::StrSplit(uid_map, '\n', absl::SkipWhitespace())) {
    const std::vector<absl::string_view> numbers = absl::StrSplit(line, ' ', absl::SkipWhitespace());
    uint64_t count = 0;
    if (numbers.size() != 3 || !absl::SimpleAtoi(numbers[2], &count)) return false;
    mapped += count;
  }
  return mapped > 0 && mapped < kAllUsers;
}

}  // namespace locus::server
