// How the threads that answer large query batches stand beside those that talk to clients and apply updates: below
// them, so that no flood of queries makes anybody else wait.
#ifndef LOCUS_SERVER_SCHEDULING_BATCH_PRIORITY_H_
#define LOCUS_SERVER_SCHEDULING_BATCH_PRIORITY_H_

#include "server/config/server_config.h"

namespace locus::server {

// Of the calling thread, for good. What the system refuses is left as it is: the work is the same, it only comes
// sooner.
void take_priority(BatchPriority priority);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_BATCH_PRIORITY_H_
