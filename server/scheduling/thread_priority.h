// Priorities of threads: threads that answer large query batches have a lower priority than threads that serve clients
// or apply updates, so that many queries do not delay small queries and updates. Each function changes the calling
// thread permanently. If the system refuses a setting or does not support it, the setting is left unchanged; answers
// stay correct, but latencies are higher.
#ifndef LOCUS_SERVER_SCHEDULING_THREAD_PRIORITY_H_
#define LOCUS_SERVER_SCHEDULING_THREAD_PRIORITY_H_

#include "server/config/server_config.h"

namespace locus::server {

// Sets the priority of a thread that answers large batches. With kNice, the thread requests short time slices, too.
// Without this request, Linux lets even a thread of low priority run for milliseconds after another thread has woken
// up.
void take_batch_priority(BatchPriority priority);

// Requests time slices of 0.1 ms, which Linux supports from version 6.12 on. With short slices, the thread keeps its
// share of a core, but starts sooner after it wakes up, and yields sooner.
void take_short_slices();

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_THREAD_PRIORITY_H_
