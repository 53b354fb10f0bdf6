// Lets a few threads at once do long work that is outside the fair share of queries, such as visiting all objects of a
// scene. The others wait, so the work occupies a bounded number of cores however many callers ask for it.
//
// Threads: any. Waiting threads are blocked; they take their turns in no particular order.
#ifndef LOCUS_SERVER_SCHEDULING_TURNS_H_
#define LOCUS_SERVER_SCHEDULING_TURNS_H_

#include <cstdint>

#include "server/scheduling/semaphore.h"

namespace locus::server {

class Turns {
 public:
  // At most `max` turns are taken at once; at least 1.
  explicit Turns(uint32_t max) {
    for (uint32_t i = 0; i < max; ++i) free_.post();
  }

  // A turn, from the constructor, which waits for it, to the destructor. The Turns must outlive it.
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
