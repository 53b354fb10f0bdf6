// Redirects the messages of gRPC and protobuf to the daemon's log.
#ifndef LOCUS_SERVER_RPC_LIBRARY_LOGS_H_
#define LOCUS_SERVER_RPC_LIBRARY_LOGS_H_

#include "server/config/server_config.h"

namespace locus::server {

// Logs gRPC's errors at level `errors`, and all other messages of gRPC and protobuf at level debug, because any caller
// can cause such messages. Errors beyond kMaxLibraryLines a second are only counted. Applies to the whole process. May
// be called again, from any thread.
void capture_library_logs(LogLevel errors);

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_LIBRARY_LOGS_H_
