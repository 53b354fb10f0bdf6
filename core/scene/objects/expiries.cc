#include "core/scene/objects/expiries.h"

#include "core/base/check.h"
#include "core/base/limits.h"

namespace locus {
namespace {

// Number of ticks after which the keys are counted from a later tick. So no key overflows.
constexpr uint64_t kMaxTicksFromBase = uint64_t{1} << 62;
static_assert(kMaxTicksFromBase + limits::kMaxExpireTicks > kMaxTicksFromBase);

}  // namespace

void Expiries::check_invariants() const {
  LOCUS_CHECK_EQ(first_, queue_.empty() ? std::numeric_limits<uint64_t>::max() : queue_.begin()->first);
  LOCUS_CHECK_LE(queue_.size(), keys_.size());
  LOCUS_CHECK(queue_.empty() || keys_[queue_.begin()->second] == first_);
}

std::vector<uint32_t> Expiries::due_handles(uint64_t tick) const {
  std::vector<uint32_t> handles;
  const uint64_t now = ticks_until(tick);
  for (auto entry = queue_.begin(); entry != queue_.end() && entry->first <= now; ++entry)
    handles.push_back(entry->second);
  return handles;
}

void Expiries::put(uint32_t handle, uint64_t key) {
  keys_.set(handle, key);
  changed_ = true;
  const size_t leaves = keys_.size() / ExpiryTable::kKeysPerLeaf + 1;
  if (table_ == nullptr || !changed_leaves_.insert(handle / ExpiryTable::kKeysPerLeaf).second) return;
  replaced_bytes_ += ExpiryTable::kKeysPerLeaf * sizeof(uint64_t);
  if (changed_leaves_.size() == 1) replaced_bytes_ += leaves * sizeof(std::shared_ptr<void>);
}

void Expiries::store(uint32_t handle, uint64_t key) {
  const uint64_t before = this->key(handle);
  if (before != 0) queue_.erase({before, handle});
  if (key != 0) queue_.insert({key, handle});
  if (before != key) put(handle, key);
  first_ = queue_.empty() ? std::numeric_limits<uint64_t>::max() : queue_.begin()->first;
  LOCUS_DCHECK_CALL(check_invariants());
}

bool Expiries::set(uint32_t handle, uint64_t tick, uint64_t expire_ticks) {
  LOCUS_DCHECK_LE(expire_ticks, limits::kMaxExpireTicks);
  LOCUS_DCHECK(!due(tick));
  if (expire_ticks == 0 && key(handle) == 0) return false;
  if (queue_.empty()) base_ = tick;
  if (tick - base_ >= kMaxTicksFromBase) rebase(tick);
  const uint64_t before = key(handle);
  const uint64_t after = expire_ticks == 0 ? 0 : tick - base_ + expire_ticks;
  if (before != after) store(handle, after);
  return before != after;
}

void Expiries::erase(uint32_t handle) {
  if (key(handle) != 0) store(handle, 0);
}

void Expiries::transfer(uint32_t from, uint32_t to) {
  const uint64_t moved = key(from);
  if (moved == 0) return;
  LOCUS_DCHECK_EQ(key(to), uint64_t{0});
  store(from, 0);
  store(to, moved);
}

void Expiries::restart(uint64_t from, uint64_t to) {
  if (from == to || queue_.empty()) return;
  base_ += to - from;
  changed_ = true;
}

void Expiries::rebase(uint64_t tick) {
  const uint64_t passed = tick - base_;
  absl::btree_set<std::pair<uint64_t, uint32_t>> queue;
  for (const auto& [key, handle] : queue_) {
    LOCUS_DCHECK_LT(passed, key);
    queue.insert(queue.end(), {key - passed, handle});
    put(handle, key - passed);
  }
  queue_ = std::move(queue);
  base_ = tick;
  first_ = queue_.empty() ? std::numeric_limits<uint64_t>::max() : queue_.begin()->first;
  LOCUS_DCHECK_CALL(check_invariants());
}

std::shared_ptr<const ExpiryTable> Expiries::table() {
  if (changed_)
    table_ = queue_.empty() ? nullptr : std::make_shared<const ExpiryTable>(keys_.snapshot(), base_, queue_.size());
  changed_ = false;
  changed_leaves_.clear();
  return table_;
}

}  // namespace locus
