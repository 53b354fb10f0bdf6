#include "tests/bench/frame/case_filter.h"

#include <array>

#include "absl/strings/str_cat.h"

namespace locus::bench {

absl::StatusOr<CaseFilter> CaseFilter::create(const std::string& pattern) {
  if (pattern.empty()) return CaseFilter();
  regex_t compiled{};
  const int code = regcomp(&compiled, pattern.c_str(), REG_EXTENDED | REG_NOSUB);
  if (code != 0) {
    std::array<char, 200> reason{};
    regerror(code, &compiled, reason.data(), reason.size());
    return absl::InvalidArgumentError(absl::StrCat("`", pattern, "` is no regular expression: ", reason.data()));
  }
  CaseFilter filter;
  filter.pattern_ = std::shared_ptr<const regex_t>(new regex_t(compiled), [](const regex_t* owned) {
    auto* const freed = const_cast<regex_t*>(owned);
    regfree(freed);
    delete freed;
  });
  return filter;
}

bool CaseFilter::wants(const std::string& case_name) const {
  return pattern_ == nullptr || regexec(pattern_.get(), case_name.c_str(), 0, nullptr, 0) == 0;
}

}  // namespace locus::bench
