// Backup: everything in the data directory as it is at one moment, streamed file after file. The log makes the copy
// under the data directory (hard links: milliseconds), a thread that stands below those who answer reads it out, and it
// is removed however the call ends.
#ifndef LOCUS_SERVER_SERVICES_BACKUP_H_
#define LOCUS_SERVER_SERVICES_BACKUP_H_

#include <grpcpp/support/sync_stream.h>

#include "absl/status/status.h"
#include "locus/v1/server_service.pb.h"
#include "server/host/host.h"
#include "server/rpc/call.h"

namespace locus::server {

inline constexpr const char* kBackupFeature = "backup";
// Within the data directory, while a backup is under way.
inline constexpr const char* kBackupDirectory = "backup.partial";

// Whether there is a data directory to copy.
bool can_back_up(const Host& host);

// What a process that ended in the middle of a backup left behind, which keeps old files from being freed. Before the
// first call.
void remove_leftover_backup(const Host& host);

absl::Status back_up(Host& host, const Caller& caller, grpc::ServerWriter<v1::BackupResponse>& writer);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_BACKUP_H_
