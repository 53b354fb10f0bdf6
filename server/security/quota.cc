#include "server/security/quota.h"

namespace locus::server {

std::optional<QuotaKind> quota_named(absl::string_view name) {
  for (size_t i = 0; i < kQuotaKinds; ++i)
    if (kQuotaNames[i] == name) return static_cast<QuotaKind>(i);
  return std::nullopt;
}

}  // namespace locus::server
