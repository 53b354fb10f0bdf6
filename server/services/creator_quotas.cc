#include "server/services/creator_quotas.h"

#include <algorithm>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "core/base/limits.h"
#include "core/base/status_macros.h"
#include "server/scheduling/clocks.h"
#include "server/security/security_limits.h"

namespace locus::server {
namespace {

static_assert(kMaxPrincipalBytes <= limits::kMaxCreatorLength);

bool is_counted(const Host& host, const std::string& creator) {
  return !creator.empty() && host.access != nullptr && host.access->rules()->has_quotas();
}

absl::StatusOr<QuotaHold> hold_created(Host& host, const std::string& creator, QuotaKind kind, uint64_t amount,
                                       Quotas::Besides registered) {
  if (!is_counted(host, creator)) return QuotaHold();
  return host.quotas.hold({&creator, 1}, kind, static_cast<double>(amount), steady_nanoseconds(), registered);
}

uint64_t inserted(const UpdateBatch& batch) {
  uint64_t items = 0;
  for (const InsertColumns& insert : batch.inserts) items += insert.ids.size();
  for (const UpdateBatch& message : batch.earlier) items += inserted(message);
  return items;
}

// Count of the objects by which a batch makes a scene larger, message by message. An upper bound: inserts that will be
// refused are counted, and removals by group are not.
class Growth {
 public:
  explicit Growth(const Scene& scene) : snapshot_(scene.latest()) {}

  void add(const UpdateBatch& message) {
    if (message.clear) clear();
    for (const Id id : message.remove_ids)
      if (is_there(id)) set(id, false);
    for (const InsertColumns& insert : message.inserts)
      for (const Id id : insert.ids)
        if (!is_there(id)) set(id, true);
  }
  uint64_t growth() const { return growth_ > 0 ? static_cast<uint64_t>(growth_) : 0; }

 private:
  bool is_there(Id id) const {
    const auto changed = changed_.find(id);
    return changed != changed_.end() ? changed->second : !cleared_ && snapshot_->objects.find_ref(id);
  }
  void set(Id id, bool there) {
    changed_[id] = there;
    growth_ += there ? 1 : -1;
  }
  void clear() {
    cleared_ = true;
    changed_.clear();
    growth_ = -static_cast<int64_t>(snapshot_->objects.size());
  }

  const SnapshotPtr snapshot_;
  bool cleared_ = false;
  absl::flat_hash_map<Id, bool> changed_;  // whether an object exists after the messages so far
  int64_t growth_ = 0;
};

// Returns an upper bound of the number of objects by which the batch makes the scene larger. O(ids).
uint64_t growth_of(const Scene& scene, const UpdateBatch& batch) {
  Growth growth(scene);
  for (const UpdateBatch& message : batch.earlier) growth.add(message);
  growth.add(batch);
  return growth.growth();
}

}  // namespace

std::string creator_name(const Caller& caller) {
  const AccessControl* const access = caller.state().access;
  return access == nullptr || !access->enabled() ? std::string() : caller.identity().principal;
}

absl::StatusOr<std::vector<QuotaHold>> hold_scene(Host& host, const SceneSpec& spec) {
  std::vector<QuotaHold> holds(2);
  ASSIGN_OR_RETURN(holds[0], hold_created(host, spec.creator, QuotaKind::kScenes, 1, [&] {
                     return static_cast<double>(host.registry.creator_use(spec.creator).scenes);
                   }));
  if (spec.history.bytes == 0) return holds;
  ASSIGN_OR_RETURN(holds[1], hold_created(host, spec.creator, QuotaKind::kHistoryBytes, spec.history.bytes, [&] {
                     return static_cast<double>(host.registry.creator_use(spec.creator).history_bytes);
                   }));
  return holds;
}

absl::StatusOr<QuotaHold> hold_mesh_bytes(Host& host, const std::string& creator, uint64_t bytes) {
  return hold_created(host, creator, QuotaKind::kMeshBytes, bytes,
                      [&] { return static_cast<double>(host.registry.creator_use(creator).mesh_bytes); });
}

absl::StatusOr<QuotaHold> hold_objects(Host& host, const Scene& scene, const UpdateBatch& batch) {
  const std::string& creator = scene.spec().creator;
  const uint64_t most = inserted(batch);
  if (most == 0 || !is_counted(host, creator)) return QuotaHold();
  const auto registered = [&scene] { return static_cast<double>(scene.counted_objects()); };
  absl::StatusOr<QuotaHold> hold = hold_created(host, creator, QuotaKind::kObjects, most, registered);
  if (hold.ok()) return hold;
  const uint64_t growth = growth_of(scene, batch);
  if (growth == 0) return QuotaHold();
  return growth == most ? std::move(hold) : hold_created(host, creator, QuotaKind::kObjects, growth, registered);
}

}  // namespace locus::server
