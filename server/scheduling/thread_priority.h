// How threads stand beside each other: those that answer large query batches below those that talk to clients and apply
// updates, so that no flood of queries makes anybody else wait. Each function is about the calling thread, for good.
// What the system refuses, or is too old for, is left as it is: the work is the same, somebody only waits longer.
#ifndef LOCUS_SERVER_SCHEDULING_THREAD_PRIORITY_H_
#define LOCUS_SERVER_SCHEDULING_THREAD_PRIORITY_H_

#include "server/config/server_config.h"

namespace locus::server {

// Of a thread that answers large batches. Without kIdle it gives its core to whoever wakes up after a short slice: by
// itself Linux lets it go on for milliseconds, however low it stands.
void take_batch_priority(BatchPriority priority);

// Asks Linux, from 6.12 on, for slices of 0.1 ms: for the same share of a core it comes on sooner when it wakes up, and
// goes sooner.
void take_short_slices();

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_THREAD_PRIORITY_H_
