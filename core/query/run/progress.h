// Progress of a batch that several threads work on in chunks. For the scheduler that assigns threads to batches.
#ifndef LOCUS_CORE_QUERY_RUN_PROGRESS_H_
#define LOCUS_CORE_QUERY_RUN_PROGRESS_H_

#include <cstdint>

namespace locus {

enum class Progress : uint8_t {
  kMore,   // at least one chunk may be started
  kBegun,  // no chunk may be started now: other threads are working, and may make more available when they finish
  kDone,   // the result is complete; returned to exactly one caller, the last one that worked
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_PROGRESS_H_
