// Priorities of threads: threads that answer large query batches run below those that serve clients and apply updates,
// so that no flood of queries delays the rest. Each function changes the calling thread permanently. If the system
// refuses a setting or does not know it, the setting is left unchanged; answers stay correct, but latencies are higher.
#ifndef LOCUS_SERVER_SCHEDULING_THREAD_PRIORITY_H_
#define LOCUS_SERVER_SCHEDULING_THREAD_PRIORITY_H_

#include "server/config/server_config.h"

namespace locus::server {

// Sets the priority of a thread that answers large batches. kNice also asks for short slices, since Linux otherwise
// lets even a nice thread run for milliseconds after another thread has woken up.
void take_batch_priority(BatchPriority priority);

// Asks Linux (6.12 or later) for time slices of 0.1 ms: with the same share of a core the thread starts sooner after it
// wakes up, and yields sooner.
void take_short_slices();

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_THREAD_PRIORITY_H_
