// Reports four kinds of events that no call causes. The first kind: changed files of TLS or access control were put
// into use, or could not be used. Such an event is counted for /metrics and written to the audit log. The second kind:
// connections were refused or closed. The third kind: a scene or mesh that was not used was deleted. The fourth
// kind: a lease ended, and its objects were removed. Such events are only written to the audit log. Other code writes
// lines about these events to the normal log.
#ifndef LOCUS_SERVER_SERVICES_SERVER_EVENTS_H_
#define LOCUS_SERVER_SERVICES_SERVER_EVENTS_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "server/rpc/rpc_state.h"

namespace locus::server {

// Reports that changed files were read. `loads`, a member of `state`, counts these readings, and `files` names the
// files in the audit log. `status` is OK if the new content is in use now. Any thread.
void report_reload(const RpcState& state, FileLoads& loads, absl::string_view files, const absl::Status& status);

// Reports `count` connections that were refused or closed since the last report of this kind. `peer` (Peer::label or
// Peer::address) and `address` (Peer::limit_key) name the last of them; empty if they are not known. `status` says why.
// The caller limits how often it reports; the audit log then limits the lines of each address. Any thread.
void report_connections(const RpcState& state, uint64_t count, absl::string_view peer, absl::string_view address,
                        const absl::Status& status);

// Reports that the server deleted `subject`, a scene or mesh, by itself, as the method `rpc` does, or could not delete
// it. `why` is the reason of the deletion. Any thread.
void report_deletion(const RpcState& state, absl::string_view rpc, absl::string_view subject,
                     const absl::Status& status, absl::string_view why);

// Reports that the lease of a silent writer in `scene` ended, and that `objects` objects were removed. The audit log
// has such ends in its lines of updates (audit_updates.h), because there may be thousands in a second. Any thread.
void report_lease_end(const RpcState& state, const std::string& scene, uint64_t objects);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_SERVER_EVENTS_H_
