// Reception of the message stream of Client::backup. Internal to the library.
#ifndef LOCUS_CLIENT_LIB_BACKUP_DOWNLOAD_H_
#define LOCUS_CLIENT_LIB_BACKUP_DOWNLOAD_H_

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client/lib/backup.h"
#include "locus/v1/server_service.grpc.pb.h"

namespace locus::client {

// Performs Client::backup with this stub. Fails with DEADLINE_EXCEEDED after `deadline`.
absl::StatusOr<BackupSize> download_backup(v1::ServerService::StubInterface& stub, BackupSink& sink,
                                           absl::Time deadline);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_BACKUP_DOWNLOAD_H_
