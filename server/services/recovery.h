// Brings back what the log keeps when the server starts: meshes first, then the scenes that they are placed in, several
// at a time. What is damaged is named and left out, all else is served. Logs how far it is.
#ifndef LOCUS_SERVER_SERVICES_RECOVERY_H_
#define LOCUS_SERVER_SERVICES_RECOVERY_H_

#include <atomic>

#include "absl/status/status.h"
#include "server/host/host.h"

namespace locus::server {

// Before calls are served; `host` has a log and an empty registry. Damage is no error: the registry knows of it.
// CANCELLED soon after `stop` is true; an error of the log that is no damage, such as a disk that cannot be read.
absl::Status recover_all(Host& host, const std::atomic<bool>& stop);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_RECOVERY_H_
