// Limits how many threads at a time do long work outside of the query scheduler, such as visiting all objects of a
// scene. Other threads wait, so the work occupies a bounded number of cores.
//
// Threads: any. Waiting threads are blocked; they take their turns in no particular order.
#ifndef LOCUS_SERVER_SCHEDULING_TURNS_H_
#define LOCUS_SERVER_SCHEDULING_TURNS_H_

#include <cstdint>

#include "server/scheduling/semaphore.h"

namespace locus::server {

class Turns {
 public:
  // Allows at most `max` turns at a time. `max` must be at least 1.
  explicit Turns(uint32_t max) {
    for (uint32_t i = 0; i < max; ++i) free_.post();
  }

  // Holds one turn. The constructor waits for the turn, the destructor ends it. The Turns must outlive the Turn.
  class Turn {
   public:
    explicit Turn(Turns& turns) : turns_(turns) { turns_.free_.wait(); }
    ~Turn() { turns_.free_.post(); }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    Turns& turns_;
  };

 private:
  Semaphore free_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_TURNS_H_
