// Context of the queries of one chunk: the snapshot, the filters of its queries, the work budget of the batch, and its
// stop. For the query kinds.
//
// Threads: a QueryTask belongs to one thread; the tasks of a batch share one BatchControl, which is thread-safe.
// Invariants: ended() and BatchControl::stopped() never become false again; a task has reported at most the work that
// it counted.
#ifndef LOCUS_CORE_QUERY_KINDS_QUERY_TASK_H_
#define LOCUS_CORE_QUERY_KINDS_QUERY_TASK_H_

#include <algorithm>
#include <atomic>
#include <functional>
#include <optional>

#include "absl/status/status.h"
#include "core/base/check.h"
#include "core/base/column.h"
#include "core/base/limits.h"
#include "core/index/bvh/kernels/dispatch.h"
#include "core/index/work.h"
#include "core/query/kinds/found_objects.h"
#include "core/query/query_batch.h"
#include "core/scene/snapshot/scene_at_time.h"

namespace locus {

// Filter of one query by layers, group and id. Borrows the block's ignored ids.
class Filter {
 public:
  Filter(const QueryBlock& block, size_t query)
      : mask_(ColumnReader<uint32_t>(block.masks, 1).value(query, kAllLayers)),
        ignored_group_(ColumnReader<uint64_t>(block.ignore_groups, 1).value(query, 0)),
        ignored_ids_(block.ignore_ids) {}

  template <class Item>
  bool accepts(const Item& item) const {
    if ((item.layers & mask_) == 0) return false;
    if (ignored_group_ != 0 && item.group == ignored_group_) return false;
    return std::find(ignored_ids_.begin(), ignored_ids_.end(), item.id) == ignored_ids_.end();
  }

 private:
  Layers mask_;
  Group ignored_group_;
  absl::Span<const uint64_t> ignored_ids_;
};

// Work budget and stop of one batch, shared by its threads. Thread-safe.
class BatchControl {
 public:
  BatchControl(uint64_t max_work, std::function<absl::Status()> stop) : max_work_(max_work), stop_(std::move(stop)) {}

  // Adds `work` to the work done and polls the stop. Returns false if the batch ends: stopped, or out of work.
  bool report_work(uint64_t work);
  // Returns whether the work budget is used up.
  bool out_of_work() const { return max_work_ != 0 && done_.load(std::memory_order_relaxed) >= max_work_; }
  // Returns the status that stopped the batch, or OK. Only after all threads have finished.
  absl::Status status() const { return status_; }
  bool stopped() const { return stopped_.load(std::memory_order_acquire); }

 private:
  const uint64_t max_work_;
  const std::function<absl::Status()> stop_;
  std::atomic<uint64_t> done_ = 0;
  std::atomic<bool> stopping_ = false;
  std::atomic<bool> stopped_ = false;
  absl::Status status_;  // written once, by the thread that set stopping_, before it sets stopped_
};

class QueryTask {
 public:
  // Borrows `snapshot` and `control`. With `brute_force` every search tests all values instead of using index
  // structures.
  QueryTask(const SceneSnapshot& snapshot, BatchControl& control, bool brute_force)
      : snapshot_(snapshot), control_(control), brute_force_(brute_force) {}

  const SceneSnapshot& snapshot() const { return snapshot_; }
  Work& work() { return work_; }

  // Counts one primitive test; called before each. Returns false if the query ends here, truncated.
  bool count_test() {
    if (++tests_ % limits::kTestsBetweenChecks != 0) return !ended_;
    return check();
  }
  // Counts many tests at once, like count_test().
  bool count_tests(uint64_t tests) {
    const uint64_t before = tests_ / limits::kTestsBetweenChecks;
    tests_ += tests;
    return tests_ / limits::kTestsBetweenChecks == before ? !ended_ : check();
  }
  // Reports the work since the last call and polls budget and stop. Returns !ended().
  bool check();
  bool ended() const { return ended_; }

  // Returns the vector kernels for exact hits of rays in meshes; null if the processor has none, or with brute force.
  const RayKernels* ray_kernels() const { return brute_force_ ? nullptr : active_ray_kernels(); }

  // Returns the collector of the objects of ball and box queries, reused by one query after another.
  FoundObjects& found_objects() { return found_objects_; }

  // Returns whether ball and box queries may use the vector kernels.
  bool uses_region_kernels() const { return !brute_force_; }

  // Call the visitor for every candidate in an index: those that the index structure finds, or all values with brute
  // force, which serves to verify the structures.
  template <class Index, class Visitor>
  void visit_ray(const Index& index, const SlabRay<ScalarOf<typename Index::Value>>& slabs, Visitor& visitor) {
    if (brute_force_)
      visit_all(index, visitor);
    else
      index.visit_ray(slabs, visitor, work_);
  }
  template <class Index, class Visitor>
  void visit_region(const Index& index, Visitor& visitor) {
    if (brute_force_)
      visit_all(index, visitor);
    else
      index.visit_region(visitor, work_);
  }
  template <class Index, class Visitor>
  void visit_nearest(const Index& index, const Vec3d& point, Visitor& visitor) {
    if (brute_force_)
      visit_all(index, visitor);
    else
      index.visit_nearest(point, visitor, work_);
  }

  // Call the visitor for every candidate among the scene's objects at `moment`.
  template <class Visitor>
  void visit_objects_on_ray(const SceneAtTime& moment, const SlabRay<double>& slabs, Visitor& visitor) {
    const auto visit = [&visitor](const GridRef& object) { return visitor.visit(object); };
    if (brute_force_)
      moment.objects().grid().for_each(visit);
    else
      moment.visit_ray(
          slabs, [&visitor] { return std::as_const(visitor).limit(); }, work_, visit);
  }
  template <class Visitor>
  void visit_objects_near(const SceneAtTime& moment, const Vec3d& point, Visitor& visitor) {
    const auto visit = [&visitor](const GridRef& object) { return visitor.visit(object); };
    if (brute_force_)
      moment.objects().grid().for_each(visit);
    else
      moment.visit_nearest(
          point, [&visitor] { return std::as_const(visitor).limit(); }, work_, visit);
  }
  template <class Visitor>
  void visit_objects_in_region(const SceneAtTime& moment, Visitor& visitor) {
    const auto visit = [&visitor](const GridRef& object) { return visitor.visit(object); };
    if (brute_force_) {
      moment.objects().grid().for_each(visit);
      return;
    }
    const Aabbd bounds = std::as_const(visitor).bounds();
    const auto search = [&](const auto& visit_one) {
      if (walk_) return walk_->visit(work_, visit_one);
      std::as_const(visitor).region().visit(work_, visit_one);
    };
    moment.visit_asked(bounds, work_, search, visit);
  }
  // Makes visit_objects_in_region() take its regions from one walk over the regions of queries [begin, end), in order.
  // The walk prefetches the memory of the next regions while one is visited.
  void walk_regions(size_t begin, size_t end, const std::function<GridRegion(size_t)>& region_of) {
    LOCUS_DCHECK_LT(begin, end);
    walk_.emplace(begin, end, region_of);
  }

 private:
  template <class Value, class Visitor>
  static void visit_all(const Bvh<Value>& index, Visitor& visitor) {
    for (const Value& value : index.values())
      if (!visitor.visit(value)) return;
  }
  template <class Index, class Visitor>
  static void visit_all(const Index& index, Visitor& visitor) {
    bool more = true;
    index.for_each([&](const auto& value) { more = more && visitor.visit(value); });
  }

  const SceneSnapshot& snapshot_;
  BatchControl& control_;
  const bool brute_force_;
  Work work_;
  std::optional<RegionWalk> walk_;  // set by walk_regions()
  FoundObjects found_objects_;
  uint64_t tests_ = 0;          // counted by count_test() and count_tests()
  uint64_t reported_work_ = 0;  // part of work_ that control_ knows
  bool ended_ = false;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_QUERY_TASK_H_
