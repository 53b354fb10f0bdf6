// What gRPC and protobuf themselves have to say, in the daemon's own log.
#ifndef LOCUS_SERVER_RPC_LIBRARY_LOGS_H_
#define LOCUS_SERVER_RPC_LIBRARY_LOGS_H_

#include "server/config/server_config.h"

namespace locus::server {

// gRPC's errors at `errors`, all else at debug, since any caller can cause it. For the whole process; may be called
// again, from any thread.
void capture_library_logs(LogLevel errors);

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_LIBRARY_LOGS_H_
