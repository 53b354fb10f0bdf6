#include "client/cli/extras/tune/room_check.h"

#include <algorithm>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

// Share of the memory limit up to which a server accepts inserts: one in so many parts is kept from them.
constexpr double kPartsOfMemory = 8;

// Whole numbers, since a double prints with six digits.
absl::Status check(const ScratchNeed& need, const std::string& name, uint64_t needed, double available, double limit) {
  if (static_cast<double>(needed) <= available) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat("tuning makes up to ", need.scenes, " scratch scenes at a time, which need ", needed, " of ", name,
                   ", but only ", static_cast<uint64_t>(std::max(available, 0.0)), " of ", static_cast<uint64_t>(limit),
                   " are free; nothing was made"));
}

}  // namespace

absl::Status check_room(const ScratchNeed& need, const v1::GetServerResponse& server,
                        absl::Span<const v1::IdentityQuotas> quotas) {
  for (const v1::Limit& limit : server.limits()) {
    const double available = limit.value() - limit.used();
    if (limit.name() == "memory_bytes")
      RETURN_IF_ERROR(check(need, limit.name(), need.bytes, available - limit.value() / kPartsOfMemory, limit.value()));
    if (limit.name() == "scenes") RETURN_IF_ERROR(check(need, limit.name(), need.scenes, available, limit.value()));
  }
  for (const v1::IdentityQuotas& identity : quotas) {
    for (const v1::QuotaUse& quota : identity.quotas()) {
      if (!quota.has_limit() || !quota.has_available()) continue;
      const std::string name = absl::StrCat("the quota ", quota.name(), " of ", identity.identity());
      if (quota.name() == "objects") RETURN_IF_ERROR(check(need, name, need.objects, quota.available(), quota.limit()));
      if (quota.name() == "scenes") RETURN_IF_ERROR(check(need, name, need.scenes, quota.available(), quota.limit()));
    }
  }
  return absl::OkStatus();
}

}  // namespace locus::cli
