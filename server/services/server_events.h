// Events of the server that no call causes, for /metrics and the audit log: changed files of TLS or access control that
// were put into use, or could not be used. Whoever reads the files writes the line in the log.
#ifndef LOCUS_SERVER_SERVICES_SERVER_EVENTS_H_
#define LOCUS_SERVER_SERVICES_SERVER_EVENTS_H_

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "server/rpc/rpc_state.h"

namespace locus::server {

// Reports one reading of the changed files that `loads`, a member of `state`, counts. `files` names them in the audit
// log. `status` is OK if they are in use now. Any thread.
void report_reload(const RpcState& state, FileLoads& loads, absl::string_view files, const absl::Status& status);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_SERVER_EVENTS_H_
