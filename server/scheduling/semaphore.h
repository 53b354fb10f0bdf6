// Wakes threads without a lock that both sides would have to take: whoever posts never waits for a sleeper that has
// lost its processor. Thread-safe. The system's own, since std::counting_semaphore of this library may miss a wake-up.
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

  // One more wait() returns.
  void post() { sem_post(&semaphore_); }
  void wait() {
    while (sem_wait(&semaphore_) != 0) {  // a signal was handled
    }
  }

 private:
  sem_t semaphore_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_SEMAPHORE_H_
