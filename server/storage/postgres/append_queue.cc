#include "server/storage/postgres/append_queue.h"

#include <algorithm>

#include "core/base/check.h"

namespace locus::server {

void AppendQueue::run(Append& append) {
  {
    MutexLock lock(mutex_);
    waiting_.push_back(&append);
  }
  while (true) {
    std::vector<Append*> group;
    {
      MutexLock lock(mutex_);
      while (!append.done && (append.taken || committing_ >= committers_)) append.changed.wait(mutex_);
      if (append.done) return;
      group = take_group();  // may lack `append`, if earlier appends fill the group
      ++committing_;
      if (!waiting_.empty() && committing_ < committers_) waiting_.front()->changed.notify_one();
    }
    commit_(group);
    MutexLock lock(mutex_);
    LOCUS_DCHECK_GT(committing_, 0u);
    --committing_;
    for (Append* const each : group) {
      each->done = each->outcome != Append::Outcome::kBlocked;
      if (!each->done) {
        each->outcome = Append::Outcome::kNotWritten;
        each->alone = true;
        each->taken = false;
        waiting_.push_back(each);
      }
      each->changed.notify_one();
    }
    if (!waiting_.empty()) waiting_.front()->changed.notify_one();
  }
}

std::vector<Append*> AppendQueue::take_group() {
  std::vector<Append*> group;
  uint64_t bytes = 0;
  while (!waiting_.empty() && group.size() < kGroupAppends) {
    Append* const next = waiting_.front();
    if (!group.empty() && (next->alone || bytes + next->bytes > kGroupBytes)) break;
    bytes += next->bytes;
    next->taken = true;
    group.push_back(next);
    waiting_.pop_front();
    if (next->alone) break;
  }
  std::sort(group.begin(), group.end(), [](const Append* a, const Append* b) { return a->scene < b->scene; });
  LOCUS_DCHECK(std::adjacent_find(group.begin(), group.end(), [](const Append* a, const Append* b) {
                 return a->scene == b->scene;
               }) == group.end());
  return group;
}

}  // namespace locus::server
