// Backup: streams a consistent copy of the data directory, file after file. The log makes the copy inside the data
// directory (hard links, milliseconds), a thread of low priority reads it, and the copy is removed however the call
// ends. Functions without state; any thread.
#ifndef LOCUS_SERVER_SERVICES_BACKUP_H_
#define LOCUS_SERVER_SERVICES_BACKUP_H_

#include <grpcpp/support/sync_stream.h>

#include "absl/status/status.h"
#include "locus/v1/server_service.pb.h"
#include "server/host/host.h"
#include "server/rpc/call.h"

namespace locus::server {

inline constexpr const char* kBackupFeature = "backup";
// Directory of the copy inside the data directory, while a backup is running.
inline constexpr const char* kBackupDirectory = "backup.partial";

// Returns whether there is a data directory to copy.
bool can_back_up(const Host& host);

// Removes the copy that a killed process left behind; its hard links would keep old files from being freed. Call it
// before the first call is served.
void remove_leftover_backup(const Host& host);

// Serves one Backup call. Errors: RESOURCE_EXHAUSTED while another backup runs or if the disk is full, UNIMPLEMENTED
// without a data directory, DATA_LOSS if a file of the copy cannot be read.
absl::Status back_up(Host& host, const Caller& caller, grpc::ServerWriter<v1::BackupResponse>& writer);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_BACKUP_H_
