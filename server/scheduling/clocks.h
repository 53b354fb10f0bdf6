// The two clocks that measure work, in nanoseconds. Thread-safe.
#ifndef LOCUS_SERVER_SCHEDULING_CLOCKS_H_
#define LOCUS_SERVER_SCHEDULING_CLOCKS_H_

#include <time.h>

#include <chrono>
#include <cstdint>

namespace locus::server {

// Returns the time since an arbitrary start. Takes about 0.03 us.
inline uint64_t steady_nanoseconds() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return static_cast<uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(since).count());
}

// Returns the processor time of the calling thread since it started, which excludes time spent waiting for a core.
// Takes 0.2 to 1 us (a system call).
inline uint64_t thread_nanoseconds() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<uint64_t>(now.tv_sec) * 1'000'000'000 + static_cast<uint64_t>(now.tv_nsec);
}

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_CLOCKS_H_
