// Counting semaphore (sem_t). Poster and waiter share no lock, so post() never waits for a waiter that lost its core.
// Not std::counting_semaphore, because libstdc++ 12's may miss a wake-up. Thread-safe.
#ifndef LOCUS_SERVER_SCHEDULING_SEMAPHORE_H_
#define LOCUS_SERVER_SCHEDULING_SEMAPHORE_H_

#include <semaphore.h>

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

 private:
  sem_t semaphore_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_SEMAPHORE_H_
