// Members of Scene for a server that follows the scene's leader.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "core/scene/scene.h"

namespace locus {

absl::StatusOr<SnapshotPtr> Scene::follow(const LogEntry& record, const MeshOfRecord& find_mesh, Deadline until) {
  ASSIGN_OR_RETURN(Record decoded, Record::decode(record.bytes));
  while (true) {
    RETURN_IF_ERROR(wait_for_readers(until));
    const MutexLock lock(writer_mutex_);
    RETURN_IF_ERROR(check_open());
    LOCUS_CHECK(!journal_.on());
    if (pins_->over_budget()) continue;
    if (record.epoch != writer_.epoch())
      return absl::FailedPreconditionError(
          absl::StrCat("the record belongs to the epoch ", record.epoch, ", not to ", writer_.epoch()));
    ASSIGN_OR_RETURN(const SnapshotPtr snapshot, apply_record(writer_, decoded.content(), find_mesh));
    publish_leases();
    if (snapshot != nullptr) publish(snapshot);
    return latest();
  }
}

void Scene::begin_leading(const SceneLog& log) {
  const MutexLock lock(writer_mutex_);
  journal_.begin(log);
  const MutexLock state_lock(mutex_);
  next_chosen_id_ = std::max({next_chosen_id_, latest_->statics->first_id_above(), kFirstChosenId + latest_->revision});
}

}  // namespace locus
