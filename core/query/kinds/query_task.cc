#include "core/query/kinds/query_task.h"

namespace locus {

bool BatchControl::report_work(uint64_t work) {
  done_.fetch_add(work, std::memory_order_relaxed);
  if (stopped() || out_of_work()) return false;
  if (!stop_) return true;
  absl::Status status = stop_();
  if (status.ok()) return true;
  if (!stopping_.exchange(true)) {
    LOCUS_DCHECK(!stopped());
    status_ = std::move(status);
    stopped_.store(true, std::memory_order_release);
  }
  return false;
}

bool QueryTask::check() {
  const uint64_t done = work_.nodes + work_.cells + work_.tests;
  LOCUS_DCHECK_GE(done, reported_work_);
  ended_ = ended_ || !control_.report_work(done - reported_work_);
  reported_work_ = done;
  return !ended_;
}

}  // namespace locus
