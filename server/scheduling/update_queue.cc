#include "server/scheduling/update_queue.h"

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

// Estimated nanoseconds to apply one item, before the first measurement.
constexpr double kFirstNanosecondsPerItem = 100;
// Fixed cost of a batch in nanoseconds: publishing its revision.
constexpr uint64_t kBatchNanoseconds = 5'000;
constexpr double kForget = 0.1;
constexpr uint32_t kFullQueueRetryMs = 5;
// Maximum number of items logged with one sync. Applying so many items takes many times as long as the sync, so a
// larger group would gain little.
constexpr uint64_t kMaxItemsPerSync = uint64_t{1} << 15;
// Interval at which the queue checks whether a scene's readers have released their revoked pins (reader_tracker.h), and
// the length of a stall after which Scene::revoke_overdue_readers() is called.
constexpr milliseconds kReaderPollInterval{2};
constexpr milliseconds kReaderGrace{1000};

bool coalesces(const Scene& scene) { return scene.spec().overload == OverloadPolicy::kLatestWins; }

// Returns whether the scene's acks wait for the disk, or for the engine of a cluster. The queue logs the waiting
// batches of such a scene together, because a sync costs the same for one batch as for many.
bool waits_for_disk(const Scene& scene) {
  return scene.log_key() != 0 && scene.spec().durability != Durability::kMemory;
}

absl::StatusOr<Scene::Acks> apply_all(Scene& scene, absl::Span<const UpdateBatch* const> batches) {
  const auto no_wait = steady_clock::time_point::min();
  if (batches.size() > 1 && coalesces(scene)) return scene.apply_joined(batches, no_wait);
  return scene.apply_each(batches, no_wait);
}

}  // namespace

UpdateQueue::UpdateQueue(const UpdateQueueOptions& options)
    : options_(options), nanoseconds_per_item_(kFirstNanosecondsPerItem) {
  LOCUS_CHECK_LE(1u, options.threads);
  LOCUS_CHECK_LE(options.threads, limits::kMaxThreads);
  for (uint32_t i = 0; i < options.threads; ++i) threads_.emplace_back([this] { run(); });
}

UpdateQueue::~UpdateQueue() {
  {
    const MutexLock lock(mutex_);
    ended_ = true;
    work_.notify_all();
  }
  for (std::thread& thread : threads_) thread.join();
}

UpdateQueue::SceneQueue& UpdateQueue::queue_of(const ScenePtr& scene) {
  std::unique_ptr<SceneQueue>& scene_queue = scene_queues_[scene.get()];
  if (scene_queue == nullptr) {
    scene_queue = std::make_unique<SceneQueue>();
    scene_queue->scene = scene;
  }
  return *scene_queue;
}

bool UpdateQueue::full(const SceneQueue& scene_queue, uint64_t items) const {
  if (scene_queue.waiting.size() >= options_.max_updates) return true;
  return !scene_queue.waiting.empty() && scene_queue.items + items > options_.max_items;
}

absl::Status UpdateQueue::refuse(const SceneQueue& scene_queue, uint64_t items) const {
  const double nanoseconds = nanoseconds_per_item_.load(std::memory_order_relaxed);
  const double drain = static_cast<double>(scene_queue.items) * nanoseconds / 2 / 1e6;
  const auto retry = static_cast<uint32_t>(std::clamp(drain, double{kFullQueueRetryMs}, 1000.0));
  if (scene_queue.waiting.size() >= options_.max_updates)
    return refuse_full("", "waiting_updates", options_.max_updates, static_cast<double>(scene_queue.waiting.size() + 1),
                       retry);
  return refuse_full("", "waiting_update_items", static_cast<double>(options_.max_items),
                     static_cast<double>(scene_queue.items + items), retry);
}

// Returns whether the caller may apply the batch itself. Batches that scan all objects or drop the history, that change
// instances, whose tree may have to be built again, or whose ack waits for the disk, are always queued.
bool UpdateQueue::fits_inline(const Scene& scene, const UpdateBatch& batch, uint64_t items) const {
  if (waits_for_disk(scene) || batch.clear || batch.restart_ticks || !batch.remove_groups.empty()) return false;
  if (has_instances(batch) || !batch.earlier.empty()) return false;
  const double nanoseconds = static_cast<double>(items) * nanoseconds_per_item_.load(std::memory_order_relaxed);
  return nanoseconds + kBatchNanoseconds < static_cast<double>(options_.inline_nanoseconds);
}

absl::StatusOr<Posted> UpdateQueue::post(const ScenePtr& scene, PendingUpdate& update, WhenFull when_full) {
  const Waiting waiting{&update, count_items(update.batch()), count_lists(update.batch())};
  const uint64_t items = waiting.items;
  SceneQueue* idle = nullptr;
  {
    const MutexLock lock(mutex_);
    SceneQueue& scene_queue = queue_of(scene);
    if (!scene_queue.busy && scene_queue.waiting.empty() && fits_inline(*scene, update.batch(), items)) {
      scene_queue.busy = true;
      idle = &scene_queue;
    } else {
      const bool is_full = full(scene_queue, items);
      if (is_full && when_full == WhenFull::kRefuse) {
        ++stats_.refused;
        return refuse(scene_queue, items);
      }
      if (scene_queue.waiting.empty() && !scene_queue.busy) {
        ready_.push_back(&scene_queue);
        work_.notify_one();
      }
      scene_queue.waiting.push_back(waiting);
      scene_queue.items += items;
      ++stats_.updates;
      stats_.items += items;
      stats_.held += is_full ? 1 : 0;
      LOCUS_DCHECK_CALL(check_invariants(scene_queue));
      return is_full ? Posted::kFull : Posted::kTaken;
    }
  }
  apply_inline(*idle, waiting);
  return Posted::kTaken;
}

void UpdateQueue::apply_inline(SceneQueue& scene_queue, const Waiting& update) {
  Group group = {update};
  const SteadyTime start = steady_clock::now();
  if (!apply(scene_queue, group)) return stall(scene_queue, group);
  if (!group.empty()) learn(update.items, start);
  std::unique_ptr<SceneQueue> empty;
  const MutexLock lock(mutex_);
  stats_.applied_inline += group.size();  // 0 if apply() dropped the update, because stop() returned an error
  empty = finish(scene_queue);
}

void UpdateQueue::run() {
  while (SceneQueue* const scene_queue = next()) work_on(*scene_queue);
}

UpdateQueue::SceneQueue* UpdateQueue::next() {
  const MutexLock lock(mutex_);
  while (true) {
    const SteadyTime now = steady_clock::now();
    const auto due = std::find_if(stalled_.begin(), stalled_.end(),
                                  [now](const SceneQueue* scene_queue) { return scene_queue->retry_at <= now; });
    SceneQueue* scene_queue = nullptr;
    if (due != stalled_.end()) {
      scene_queue = *due;
      stalled_.erase(due);
    } else if (!ready_.empty()) {
      scene_queue = ready_.front();
      ready_.pop_front();
    }
    if (scene_queue != nullptr) {
      LOCUS_DCHECK(!scene_queue->busy && !scene_queue->waiting.empty());
      scene_queue->busy = true;
      return scene_queue;
    }
    if (ended_ && scene_queues_.empty()) return nullptr;
    if (stalled_.empty())
      work_.wait(mutex_);
    else
      work_.wait_until(mutex_, now + kReaderPollInterval);
  }
}

bool UpdateQueue::changes_instances(const Group& group) {
  return std::any_of(group.begin(), group.end(),
                     [](const Waiting& waiting) { return has_instances(waiting.update->batch()); });
}

void UpdateQueue::work_on(SceneQueue& scene_queue) {
  Group group;
  uint64_t items = 0;
  {
    const MutexLock lock(mutex_);
    const uint64_t before = scene_queue.items;
    group = take_group(scene_queue);
    items = before - scene_queue.items;
  }
  const bool is_typical = !waits_for_disk(*scene_queue.scene) && !changes_instances(group);
  const SteadyTime start = steady_clock::now();
  if (!apply(scene_queue, group)) return stall(scene_queue, group);
  if (is_typical) learn(items, start);
  std::unique_ptr<SceneQueue> empty;
  const MutexLock lock(mutex_);
  empty = finish(scene_queue);
}

// Removes from the queue the batches that become one revision or share one sync, and returns them. Lists count like
// items, because empty lists are logged too and the log refuses a group that is too large.
UpdateQueue::Group UpdateQueue::take_group(SceneQueue& scene_queue) {
  const bool coalescing = coalesces(*scene_queue.scene);
  const uint64_t max_items = coalescing                           ? limits::kMaxUpdateItems
                             : waits_for_disk(*scene_queue.scene) ? kMaxItemsPerSync
                                                                  : 0;
  Group group;
  uint64_t items = 0;
  uint64_t lists = 0;
  while (!scene_queue.waiting.empty()) {
    const Waiting& next = scene_queue.waiting.front();
    const bool fits = group.empty() || (items + lists + next.items + next.lists <= max_items &&
                                        (!coalescing || may_join(group.front().update->batch(), next.update->batch())));
    if (!fits) break;
    group.push_back(next);
    items += next.items;
    lists += next.lists;
    scene_queue.waiting.pop_front();
  }
  LOCUS_DCHECK(scene_queue.busy && !group.empty());
  scene_queue.items -= items;
  stats_.items -= items;
  stats_.updates -= group.size();
  LOCUS_DCHECK_CALL(check_invariants(scene_queue));
  return group;
}

// Completes and removes the batches of the group that were cancelled or whose deadline has passed. If a deadline passed
// during a stall, done() receives the error of the stall, which names the limit that the readers exceed.
void UpdateQueue::drop_stopped(const SceneQueue& scene_queue, Group& group) {
  const auto stopped = [&scene_queue](const Waiting& waiting) {
    absl::Status status = waiting.update->stop();
    if (status.ok()) return false;
    if (status.code() == scene_queue.late.code()) status = scene_queue.late;
    waiting.update->done(std::move(status));
    return true;
  };
  group.erase(std::remove_if(group.begin(), group.end(), stopped), group.end());
}

bool UpdateQueue::apply(SceneQueue& scene_queue, Group& group) {
  drop_stopped(scene_queue, group);
  scene_queue.late = absl::OkStatus();
  if (group.empty()) return true;
  std::vector<const UpdateBatch*> batches;
  for (const Waiting& waiting : group) batches.push_back(&waiting.update->batch());
  // apply_all() returns DEADLINE_EXCEEDED instead of waiting for readers, because readers may hold their snapshots for
  // a long time.
  absl::StatusOr<Scene::Acks> acks = apply_all(*scene_queue.scene, batches);
  if (acks.status().code() == absl::StatusCode::kDeadlineExceeded) {
    scene_queue.late = acks.status();
    return false;
  }
  LOCUS_DCHECK(!acks.ok() || acks->size() == group.size());
  if (acks.ok()) count(*scene_queue.scene, group.size());
  for (size_t i = 0; i < group.size(); ++i) group[i].update->done(acks.ok() ? std::move((*acks)[i]) : acks.status());
  return true;
}

// Counts applied batches. Call it before done(), so that the statistics include a batch by the time its caller sees the
// ack.
void UpdateQueue::count(const Scene& scene, size_t updates) {
  const MutexLock lock(mutex_);
  stats_.applied += updates;
  if (updates > 1 && coalesces(scene)) stats_.coalesced += updates - 1;
}

// Queues the group again and stalls its scene, because the scene's readers hold too much memory and have not yet
// released their revoked pins. Other scenes do not wait.
void UpdateQueue::stall(SceneQueue& scene_queue, const Group& group) {
  const SteadyTime now = steady_clock::now();
  ScenePtr overdue;  // keeps the scene alive, because another thread may free the SceneQueue once mutex_ is released
  {
    const MutexLock lock(mutex_);
    LOCUS_DCHECK(scene_queue.busy && !group.empty());
    requeue(scene_queue, group);
    if (scene_queue.stalled_at == SteadyTime()) {
      scene_queue.stalled_at = now;
      ++stats_.stalls;
    }
    if (now - scene_queue.stalled_at > kReaderGrace) overdue = scene_queue.scene;
    scene_queue.retry_at = now + kReaderPollInterval;
    scene_queue.busy = false;
    stalled_.push_back(&scene_queue);
    work_.notify_one();
  }
  if (overdue != nullptr) overdue->revoke_overdue_readers();
}

void UpdateQueue::requeue(SceneQueue& scene_queue, const Group& group) {
  // NOLINTNEXTLINE(modernize-loop-convert): a range in reverse order would need std::views
  for (auto update = group.rbegin(); update != group.rend(); ++update) {
    scene_queue.waiting.push_front(*update);
    scene_queue.items += update->items;
    stats_.items += update->items;
    ++stats_.updates;
  }
  LOCUS_DCHECK_CALL(check_invariants(scene_queue));
}

std::unique_ptr<UpdateQueue::SceneQueue> UpdateQueue::finish(SceneQueue& scene_queue) {
  LOCUS_DCHECK(scene_queue.busy);
  scene_queue.busy = false;
  scene_queue.stalled_at = {};
  if (!scene_queue.waiting.empty()) {
    ready_.push_back(&scene_queue);
    work_.notify_one();
    return nullptr;
  }
  const auto found = scene_queues_.find(scene_queue.scene.get());
  std::unique_ptr<SceneQueue> empty = std::move(found->second);
  scene_queues_.erase(found);
  LOCUS_DCHECK_CALL(check_invariants(*empty));
  if (ended_) work_.notify_all();
  return empty;
}

void UpdateQueue::learn(uint64_t items, SteadyTime start) {
  if (items == 0) return;
  const auto spent = std::chrono::duration_cast<std::chrono::nanoseconds>(steady_clock::now() - start).count();
  const double per_item = static_cast<double>(spent) / static_cast<double>(items);
  const double known = nanoseconds_per_item_.load(std::memory_order_relaxed);
  // The time of a batch with few items is mostly the fixed cost of a batch, so it is not used as the cost of an item.
  const double weight = items < 64 ? 0 : kForget;
  nanoseconds_per_item_.store(known + (per_item - known) * weight, std::memory_order_relaxed);
}

// Compares the counts of one SceneQueue with the totals. O(1).
void UpdateQueue::check_invariants(const SceneQueue& scene_queue) const {
  LOCUS_CHECK_LE(scene_queue.waiting.size(), stats_.updates);
  LOCUS_CHECK_LE(scene_queue.items, stats_.items);
  if (scene_queue.waiting.empty()) LOCUS_CHECK_EQ(scene_queue.items, 0u);
  LOCUS_CHECK_LE(ready_.size() + stalled_.size(), scene_queues_.size());
  if (scene_queues_.empty()) LOCUS_CHECK_EQ(stats_.updates + stats_.items, 0u);
}

UpdateQueueStats UpdateQueue::stats() const {
  const MutexLock lock(mutex_);
  return stats_;
}

}  // namespace locus::server
