#include "server/services/server_events.h"

#include <string>
#include <utility>

#include "server/scheduling/clocks.h"

namespace locus::server {

void report_reload(const RpcState& state, FileLoads& loads, absl::string_view files, const absl::Status& status) {
  loads.record(status, unix_seconds());
  AuditLog* const log = state.access == nullptr ? nullptr : state.access->audit();
  if (log == nullptr) return;
  AuditEntry entry;
  entry.unix_ms = unix_milliseconds();
  entry.principal = "locusd";
  entry.rpc = "reload";
  entry.subject = std::string(files);
  entry.code = status.code();
  entry.text = status.ok() ? "the changed files are in use" : std::string(status.message());
  log->write(std::move(entry));
}

}  // namespace locus::server
