// Counting semaphore (sem_t). post() and wait() share no lock, so post() never waits for a thread that was preempted in
// wait(). Does not use std::counting_semaphore, because its implementation in libstdc++ 12 may miss a wake-up.
// Thread-safe.
#ifndef LOCUS_SERVER_SCHEDULING_SEMAPHORE_H_
#define LOCUS_SERVER_SCHEDULING_SEMAPHORE_H_

#include <semaphore.h>

#include <cerrno>
#include <chrono>
#include <ctime>

#include "core/base/check.h"

namespace locus::server {

class Semaphore {
 public:
  Semaphore() { LOCUS_CHECK_EQ(sem_init(&semaphore_, 0, 0), 0); }
  ~Semaphore() { sem_destroy(&semaphore_); }
  Semaphore(const Semaphore&) = delete;
  Semaphore& operator=(const Semaphore&) = delete;

  // Increments the count, which lets one wait() return.
  void post() { sem_post(&semaphore_); }
  void wait() {
    while (sem_wait(&semaphore_) != 0) {  // interrupted by a signal handler: wait again
    }
  }
  // Waits at most `time`. Returns false if the count stayed 0 for so long.
  bool wait_for(std::chrono::nanoseconds time) {
    timespec end;
    clock_gettime(CLOCK_MONOTONIC, &end);
    const std::chrono::nanoseconds sum = time + std::chrono::nanoseconds(end.tv_nsec);
    end.tv_sec += std::chrono::duration_cast<std::chrono::seconds>(sum).count();
    end.tv_nsec = (sum % std::chrono::seconds(1)).count();
    while (sem_clockwait(&semaphore_, CLOCK_MONOTONIC, &end) != 0)
      if (errno == ETIMEDOUT) return false;
    return true;
  }

 private:
  sem_t semaphore_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_SEMAPHORE_H_
