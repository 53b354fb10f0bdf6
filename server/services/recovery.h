// Recovers meshes and scenes from the log when the server starts: first all meshes, then the scenes that place them.
// Recovers several meshes or scenes at the same time. Damaged meshes and scenes are registered as damaged, and calls
// that name them are refused; all other meshes and scenes are served. Logs the progress. Chooses the epochs of new and
// of recovered scenes.
#ifndef LOCUS_SERVER_SERVICES_RECOVERY_H_
#define LOCUS_SERVER_SERVICES_RECOVERY_H_

#include <atomic>
#include <cstdint>

#include "absl/status/status.h"
#include "server/host/host.h"

namespace locus::server {

// Fills host.registry with the meshes and scenes of the log. Call it before calls are served; `host` must have a log
// and an empty registry. Damage is not an error: it is recorded in the registry. Returns CANCELLED soon after `stop`
// becomes true. Returns an error of the log other than DATA_LOSS, for example if the disk cannot be read. Blocks; uses
// the threads of host.pool.
absl::Status recover_all(Host& host, const std::atomic<bool>& stop);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_RECOVERY_H_
