// Backup: streams a consistent copy of the data directory, file after file. The log makes the copy inside the data
// directory by hard links, in milliseconds. A thread of low priority reads the copy. The copy is removed when the call
// ends, also after an error. Functions without state; any thread.
#ifndef LOCUS_SERVER_SERVICES_BACKUP_H_
#define LOCUS_SERVER_SERVICES_BACKUP_H_

#include "absl/status/status.h"
#include "server/host/host.h"
#include "server/rpc/call.h"
#include "server/rpc/message_stream.h"

namespace locus::server {

inline constexpr const char* kBackupFeature = "backup";
// Name of the directory inside the data directory that contains the copy while a backup is running.
inline constexpr const char* kBackupDirectory = "backup.partial";

// Returns whether there is a data directory to copy.
bool can_back_up(const Host& host);

// Removes the copy that a killed process left behind. The copy's hard links would otherwise keep replaced files on the
// disk. Call this function before the first call is served.
void remove_leftover_backup(const Host& host);

// Serves one Backup call. Errors: RESOURCE_EXHAUSTED while another backup runs or if the disk is full, UNIMPLEMENTED
// without a data directory, DATA_LOSS if a file of the copy cannot be read.
absl::Status back_up(Host& host, const Caller& caller, MessageStream& stream);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_BACKUP_H_
