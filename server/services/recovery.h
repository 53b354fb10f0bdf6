// Recovers meshes and scenes from the log when the server starts: meshes first, then the scenes that place them,
// several at a time. Damaged meshes and scenes are registered as damaged and refused by name; all others are served.
// Logs the progress.
#ifndef LOCUS_SERVER_SERVICES_RECOVERY_H_
#define LOCUS_SERVER_SERVICES_RECOVERY_H_

#include <atomic>

#include "absl/status/status.h"
#include "server/host/host.h"

namespace locus::server {

// Fills the registry from the log. Call it before calls are served; `host` must have a log and an empty registry.
// Damage is not an error: it is recorded in the registry. Returns CANCELLED soon after `stop` becomes true, or the
// log's error if it is not DATA_LOSS, for example a disk that cannot be read. Blocks; uses the threads of host.pool.
absl::Status recover_all(Host& host, const std::atomic<bool>& stop);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_RECOVERY_H_
