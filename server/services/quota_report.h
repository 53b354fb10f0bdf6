// Reports quotas and their use: the amounts that callers hold now (server/security/quotas.h) plus the amounts of the
// data that they created (core/scene/registry.h). No state; any thread.
#ifndef LOCUS_SERVER_SERVICES_QUOTA_REPORT_H_
#define LOCUS_SERVER_SERVICES_QUOTA_REPORT_H_

#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "locus/v1/server_service.pb.h"
#include "server/host/host.h"
#include "server/rpc/call.h"

namespace locus::server {

// Serves one GetQuotas call. PERMISSION_DENIED if the request is about other callers, and the caller does not
// administer all scenes.
absl::Status get_quotas(const Host& host, const Caller& caller, const v1::GetQuotasRequest& request,
                        v1::GetQuotasResponse& response);

// Returns the name and the largest share of each quota that limits any identity or connection. A share is the part of
// its quota that one identity or connection uses (1 = the whole quota). Considers only identities and connections that
// use or created something.
std::vector<std::pair<std::string, double>> largest_quota_shares(const Host& host);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_QUOTA_REPORT_H_
