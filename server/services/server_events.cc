#include "server/services/server_events.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/scheduling/clocks.h"

namespace locus::server {
namespace {

// Writes an entry to the audit log, if there is one, with the present time.
void audit(const RpcState& state, AuditEntry entry) {
  AuditLog* const log = state.access == nullptr ? nullptr : state.access->audit();
  if (log == nullptr) return;
  entry.unix_ms = unix_milliseconds();
  log->write(std::move(entry));
}

}  // namespace

void report_reload(const RpcState& state, FileLoads& loads, absl::string_view files, const absl::Status& status) {
  loads.record(status, unix_seconds());
  AuditEntry entry;
  entry.principal = "locusd";
  entry.rpc = "reload";
  entry.subject = std::string(files);
  entry.code = status.code();
  entry.text = status.ok() ? "the changed files are in use" : std::string(status.message());
  audit(state, std::move(entry));
}

void report_connections(const RpcState& state, uint64_t count, absl::string_view peer, absl::string_view address,
                        const absl::Status& status) {
  AuditEntry entry;
  entry.principal = anonymous_identity()->principal;
  entry.peer = std::string(peer);
  entry.address = std::string(address);
  entry.rpc = "connect";
  entry.code = status.code();
  entry.text = count == 1 ? std::string(status.message())
                          : absl::StrCat(count, " connections; the last of them: ", status.message());
  audit(state, std::move(entry));
}

void report_deletion(const RpcState& state, absl::string_view rpc, absl::string_view subject,
                     const absl::Status& status, absl::string_view why) {
  AuditEntry entry;
  entry.principal = "locusd";
  entry.rpc = std::string(rpc);
  entry.subject = std::string(subject);
  entry.code = status.code();
  entry.text = std::string(status.ok() ? why : status.message());
  audit(state, std::move(entry));
}

void report_lease_end(const RpcState& state, const std::string& scene, uint64_t objects) {
  AuditUpdates* const updates = state.access == nullptr ? nullptr : state.access->audit_updates();
  if (updates != nullptr) updates->count({"locusd", "", "end_lease", scene, objects}, unix_milliseconds());
}

}  // namespace locus::server
