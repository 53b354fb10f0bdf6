#include "server/services/quota_report.h"

#include <algorithm>
#include <array>
#include <map>

#include "absl/strings/match.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "server/scheduling/clocks.h"
#include "server/services/scene_access.h"

namespace locus::server {
namespace {

constexpr absl::string_view kConnection = "connection:";
// Upper bound in bytes of the memory of an entry with all quotas, its encoding included.
constexpr uint64_t kEntryBytes = 2048;

bool is_connection(const SubjectUse& use) { return absl::StartsWith(use.subject, kConnection); }

// Adds to `use` the amounts of the scenes, objects and meshes that the subject created.
void add_created(const CreatorUse& created, SubjectUse& use) {
  const std::pair<QuotaKind, uint64_t> amounts[] = {{QuotaKind::kObjects, created.objects},
                                                    {QuotaKind::kScenes, created.scenes},
                                                    {QuotaKind::kMeshBytes, created.mesh_bytes},
                                                    {QuotaKind::kHistoryBytes, created.history_bytes}};
  for (const auto& [kind, amount] : amounts) {
    QuotaUse& quota = use.quotas[static_cast<size_t>(kind)];
    quota.used += static_cast<double>(amount);
    quota.available = quota.limit - quota.used;
  }
}

SubjectUse use_of(const Host& host, const std::string& subject) {
  SubjectUse use = host.quotas.use_of(subject, steady_nanoseconds());
  add_created(host.registry.creator_use(subject), use);
  return use;
}

// Returns the use of all identities and connections that use or created something, ascending by name.
std::vector<SubjectUse> all_uses(const Host& host) {
  const uint64_t now = steady_nanoseconds();
  std::map<std::string, CreatorUse> created = host.registry.creator_uses();
  std::vector<SubjectUse> uses = host.quotas.usage(now);
  for (SubjectUse& use : uses) {
    const auto own = created.find(use.subject);
    if (own == created.end()) continue;
    add_created(own->second, use);
    created.erase(own);
  }
  for (const auto& [creator, own] : created) add_created(own, uses.emplace_back(host.quotas.use_of(creator, now)));
  std::sort(uses.begin(), uses.end(), [](const SubjectUse& a, const SubjectUse& b) { return a.subject < b.subject; });
  return uses;
}

void add_entry(const SubjectUse& use, v1::GetQuotasResponse& response) {
  v1::IdentityQuotas* const entry = response.add_identities();
  entry->set_identity(use.subject);
  for (size_t i = 0; i < kQuotaKinds; ++i) {
    const auto kind = static_cast<QuotaKind>(i);
    if (is_connection(use) && !is_of_connections(kind)) continue;
    v1::QuotaUse* const quota = entry->add_quotas();
    quota->set_name(std::string(quota_name(kind)));
    quota->set_used(use.quotas[i].used);
    if (use.quotas[i].limit == kNoQuota) continue;
    quota->set_limit(use.quotas[i].limit);
    quota->set_available(use.quotas[i].available);
  }
}

absl::Status check_request(const Caller& caller, const v1::GetQuotasRequest& request) {
  if (request.all() && !request.identity().empty())
    return refuse_argument(Reason::kMalformed, "identity", {}, "goes without `all`; give one of the two");
  if (request.page_size() > limits::kMaxPageSize)
    return refuse_limit("page_size", "page_size", limits::kMaxPageSize, request.page_size());
  if (!request.all() && !request.page_token().empty())
    return refuse_argument(Reason::kMalformed, "page_token", {}, "goes with `all`");
  const bool of_others =
      request.all() || (!request.identity().empty() && request.identity() != caller.identity().principal);
  if (!of_others || caller.administers_all()) return absl::OkStatus();
  return absl::PermissionDeniedError(
      "the quotas of others are for those who administer all scenes; ask the operator for a grant of `admin *`");
}

absl::Status list_all(const Host& host, const Caller& caller, const v1::GetQuotasRequest& request,
                      v1::GetQuotasResponse& response) {
  const std::vector<SubjectUse> uses = all_uses(host);
  const size_t page_size = request.page_size() == 0 ? limits::kMaxPageSize : request.page_size();
  auto use = std::upper_bound(uses.begin(), uses.end(), request.page_token(),
                              [](const std::string& token, const SubjectUse& entry) { return token < entry.subject; });
  const auto end = use + std::min<std::ptrdiff_t>(uses.end() - use, static_cast<std::ptrdiff_t>(page_size));
  ASSIGN_OR_RETURN(const CallMemory claim, claim_copy(caller, static_cast<uint64_t>(end - use) * kEntryBytes));
  for (; use != end; ++use) add_entry(*use, response);
  if (end != uses.end()) response.set_next_page_token(response.identities().rbegin()->identity());
  return absl::OkStatus();
}

}  // namespace

absl::Status get_quotas(const Host& host, const Caller& caller, const v1::GetQuotasRequest& request,
                        v1::GetQuotasResponse& response) {
  RETURN_IF_ERROR(check_request(caller, request));
  if (request.all()) return list_all(host, caller, request, response);
  if (!request.identity().empty()) {
    add_entry(use_of(host, request.identity()), response);
    return absl::OkStatus();
  }
  for (const std::string& subject : caller.quota_subjects()) add_entry(use_of(host, subject), response);
  return absl::OkStatus();
}

std::vector<std::pair<std::string, double>> largest_quota_shares(const Host& host) {
  std::array<double, kQuotaKinds> shares;
  shares.fill(-1);
  for (const SubjectUse& use : all_uses(host))
    for (size_t i = 0; i < kQuotaKinds; ++i) {
      const QuotaUse& quota = use.quotas[i];
      if (quota.limit == kNoQuota) continue;
      const double share = quota.limit > 0 ? quota.used / quota.limit : quota.used > 0 ? 1 : 0;
      shares[i] = std::max(shares[i], share);
    }
  std::vector<std::pair<std::string, double>> named;
  for (size_t i = 0; i < kQuotaKinds; ++i)
    if (shares[i] >= 0) named.emplace_back(kQuotaNames[i], shares[i]);
  return named;
}

}  // namespace locus::server
