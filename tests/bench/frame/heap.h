// Number of bytes that the process has allocated by malloc and not freed. Used by cases that measure memory. Any thread
// may call it.
#ifndef LOCUS_TESTS_BENCH_FRAME_HEAP_H_
#define LOCUS_TESTS_BENCH_FRAME_HEAP_H_

#include <malloc.h>

#include <cstdint>

namespace locus::bench {

inline int64_t heap_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<int64_t>(info.uordblks + info.hblkhd);
}

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_FRAME_HEAP_H_
