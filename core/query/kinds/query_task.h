// What every query of a batch needs to know besides its own numbers: where to look, whom to pass over, how much work is
// left, and when to end. One for each piece of a batch that runs on one thread.
#ifndef LOCUS_CORE_QUERY_KINDS_QUERY_TASK_H_
#define LOCUS_CORE_QUERY_KINDS_QUERY_TASK_H_

#include <algorithm>
#include <atomic>
#include <functional>
#include <optional>

#include "absl/status/status.h"
#include "core/base/column.h"
#include "core/base/limits.h"
#include "core/index/bvh/kernels/dispatch.h"
#include "core/index/work.h"
#include "core/query/kinds/found_objects.h"
#include "core/query/query_batch.h"
#include "core/scene/snapshot/scene_at_time.h"

namespace locus {

// Whom one query may find.
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

// What the threads of one batch share. Thread-safe.
class BatchControl {
 public:
  BatchControl(uint64_t max_work, std::function<absl::Status()> stop) : max_work_(max_work), stop_(std::move(stop)) {}

  // Books work done; false when the batch is to end: nothing more of it matters, or the budget is used up.
  bool go_on(uint64_t work);
  bool out_of_work() const { return max_work_ != 0 && done_.load(std::memory_order_relaxed) >= max_work_; }
  // The status that ended the batch, or OK. Only after all threads have come back.
  absl::Status status() const { return status_; }
  bool stopped() const { return stopped_.load(std::memory_order_acquire); }

 private:
  const uint64_t max_work_;
  const std::function<absl::Status()> stop_;
  std::atomic<uint64_t> done_ = 0;
  std::atomic<bool> stopping_ = false;
  std::atomic<bool> stopped_ = false;
  absl::Status status_;  // written once, by whoever turned stopping_ true, before stopped_
};

class QueryTask {
 public:
  QueryTask(const SceneSnapshot& snapshot, BatchControl& control, bool brute_force)
      : snapshot_(snapshot), control_(control), brute_force_(brute_force) {}

  const SceneSnapshot& snapshot() const { return snapshot_; }
  Work& work() { return work_; }

  // To be called for every primitive test; false when the query is to end, cut short.
  bool count_test() {
    if (++tests_ % limits::kTestsBetweenChecks != 0) return !ended_;
    return check();
  }
  // The same for many tests at once.
  bool count_tests(uint64_t tests) {
    const uint64_t before = tests_ / limits::kTestsBetweenChecks;
    tests_ += tests;
    return tests_ / limits::kTestsBetweenChecks == before ? !ended_ : check();
  }
  // Looks at the budget and at the end of the batch.
  bool check();
  bool ended() const { return ended_; }

  // Kernels for exact hits of rays in meshes; null where there are none, or where all values are to be tested.
  const RayKernels* ray_kernels() const { return brute_force_ ? nullptr : active_ray_kernels(); }

  // Where a ball or box puts its objects: one query after the other.
  FoundObjects& found_objects() { return found_objects_; }

  // Whether ball and box queries may ask the kernels.
  bool searches_triangles() const { return !brute_force_; }

  // Every candidate of an index: by its structure, or, for whoever wants to check that, simply all values.
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

  // The same of the scene's objects at a moment, which visitors take by reference.
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
    const auto ask = [&](const auto& visit_one) {
      if (walk_) return walk_->visit(work_, visit_one);
      std::as_const(visitor).region().visit(work_, visit_one);
    };
    moment.visit_asked(bounds, work_, ask, visit);
  }
  // The regions of the visits above are those of the walk from here on, one after the other.
  void walk_regions(size_t begin, size_t end, const std::function<GridRegion(size_t)>& region_of) {
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
  std::optional<RegionWalk> walk_;
  FoundObjects found_objects_;
  uint64_t tests_ = 0;
  uint64_t booked_ = 0;
  bool ended_ = false;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_QUERY_TASK_H_
