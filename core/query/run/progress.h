// Progress of a batch that several threads work on in chunks. Used by the scheduler, which assigns threads to batches.
#ifndef LOCUS_CORE_QUERY_RUN_PROGRESS_H_
#define LOCUS_CORE_QUERY_RUN_PROGRESS_H_

#include <cstdint>

namespace locus {

enum class Progress : uint8_t {
  kMore,   // at least one chunk may be started
  kBegun,  // no chunk may be started now: other threads must finish their chunks first, or kDone was already returned
  kDone,   // the batch has ended; work() returns kDone once, to the last caller that worked
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_PROGRESS_H_
