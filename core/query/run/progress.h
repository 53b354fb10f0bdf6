// How far a batch is that several threads work on in pieces. For whoever hands out its work.
#ifndef LOCUS_CORE_QUERY_RUN_PROGRESS_H_
#define LOCUS_CORE_QUERY_RUN_PROGRESS_H_

#include <cstdint>

namespace locus {

enum class Progress : uint8_t {
  kMore,   // there is work left to begin
  kBegun,  // nothing to begin just now: other threads are at it, after which there may be more
  kDone,   // the answer is complete; told to one caller only, the last
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_PROGRESS_H_
