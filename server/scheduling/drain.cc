#include "server/scheduling/drain.h"

#include <utility>

namespace locus::server {

void Drain::begin() {
  MutexLock lock(mutex_);
  if (draining_.exchange(true)) return;
  for (const Listener& listener : listeners_) listener();
}

std::list<Drain::Listener>::iterator Drain::add(Listener listener) {
  MutexLock lock(mutex_);
  if (draining_.load()) listener();
  return listeners_.insert(listeners_.end(), std::move(listener));
}

void Drain::remove(std::list<Listener>::iterator position) {
  MutexLock lock(mutex_);
  listeners_.erase(position);
}

}  // namespace locus::server
