#include "client/cli/script/variables.h"

#include <algorithm>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/cli/script/script_limits.h"

namespace locus::cli {

bool begins_name(char c) { return absl::ascii_isalpha(static_cast<unsigned char>(c)) || c == '_'; }
bool continues_name(char c) { return begins_name(c) || absl::ascii_isdigit(static_cast<unsigned char>(c)); }

bool is_name(absl::string_view text) {
  return !text.empty() && begins_name(text.front()) && std::all_of(text.begin(), text.end(), continues_name);
}

absl::Status Variables::set(const std::string& name, Value value) {
  if (!is_name(name)) {
    return absl::InvalidArgumentError(
        absl::StrCat("`", name, "` is not a name: use letters, digits and _, and begin with no digit"));
  }
  const auto found = values_.find(name);
  if (found == values_.end() && values_.size() >= kMaxVariables) {
    return absl::ResourceExhaustedError(absl::StrCat("more than ", kMaxVariables, " variables"));
  }
  values_[name] = std::move(value);
  return absl::OkStatus();
}

const Value* Variables::find(const std::string& name) const {
  const auto found = values_.find(name);
  return found == values_.end() ? nullptr : &found->second;
}

}  // namespace locus::cli
