// Context in which the queries of one chunk run: the snapshot, searches of its indexes, filters, and the work budget
// and cancellation of the batch. All kinds of queries use this context.
//
// Threads: a QueryTask belongs to one thread; the tasks of a batch share one BatchControl, which is thread-safe.
// Invariants: once true, ended() and BatchControl::stopped() stay true; a task has reported at most as much work as it
// has counted.
#ifndef LOCUS_CORE_QUERY_KINDS_QUERY_TASK_H_
#define LOCUS_CORE_QUERY_KINDS_QUERY_TASK_H_

#include <algorithm>
#include <array>
#include <atomic>
#include <functional>
#include <memory>
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

class ObjectBoxes;

// Filter of one query by layers, groups, tag and id; the query's anchor is not accepted. Borrows the block. Most
// queries filter by layers only, or also by one ignored group; the filter contains what these compare. It reads the
// columns of all other filters where a block has some, so that it stays small: a call of the ray kernels has many
// filters in use.
class Filter {
 public:
  Filter(const QueryBlock& block, size_t query)
      : mask_(ColumnReader<uint32_t>(block.masks, 1).value(query, kAllLayers)),
        query_(static_cast<uint32_t>(query)),
        block_(&block),
        ignored_groups_{ColumnReader<uint64_t>(block.ignore_groups, 1).value(query, 0)},
        anchor_(ColumnReader<uint64_t>(block.anchor_ids, 1).value(query, kNoId)),
        has_rare_filters_(
            (block.ignore_ids.size() | block.only_groups.size() | block.tags.size() | block.self_ids.size()) != 0),
        layers_only_(ignored_groups_[0] == 0 && anchor_ == kNoId && !has_rare_filters_) {}

  // Makes the filter ignore two more groups; 0 stands for no group. Another call replaces both groups.
  void ignore(Group first, Group second) {
    ignored_groups_[1] = first;
    ignored_groups_[2] = second;
    if (first != 0 || second != 0) layers_only_ = false;
  }
  // Returns the layers that the filter accepts. A part of a compound is found if the filter accepts the object, and one
  // of these layers is a layer of both the object and the part.
  Layers layers() const { return mask_; }
  // Makes the filter accept nothing, for a query that has no answer.
  void accept_nothing() { mask_ = 0; }
  template <class Item>
  bool accepts(const Item& item) const {
    if ((item.layers & mask_) == 0) return false;
    if (layers_only_) return true;
    if (item.group != 0 &&
        std::find(ignored_groups_.begin(), ignored_groups_.end(), item.group) != ignored_groups_.end())
      return false;
    if (item.id == anchor_) return false;
    return !has_rare_filters_ || passes_rare_filters(item.group, item.tag, item.id);
  }

 private:
  // Returns whether the filters by ignored ids, own id, wanted groups and tag accept an item.
  bool passes_rare_filters(Group group, Tag tag, Id id) const;

  Layers mask_;
  uint32_t query_;
  const QueryBlock* block_;
  std::array<Group, 3> ignored_groups_;  // 0: none
  Id anchor_;                            // kNoId if the query has no anchor
  bool has_rare_filters_;                // whether passes_rare_filters() must be called
  bool layers_only_;                     // every other condition accepts everything
};

// Returns the rotation of query `i` in an optional column of quaternions x, y, z, w. Returns the identity if the column
// has no entries.
inline Rotation rotation_entry(absl::Span<const float> rotations, size_t i) {
  const ColumnReader<float> reader(rotations, 4);
  if (!reader.given()) return {};
  const float* q = reader.entry(i);
  return rotation_of(Quaternion{q[0], q[1], q[2], q[3]});
}

// Work budget and cancellation of one batch, shared by all threads that work on it. Thread-safe.
class BatchControl {
 public:
  // `max_work` is the maximum number of nodes, cells and primitive tests; 0: no limit. `stop` may be empty; if it
  // returns a status that is not OK, the batch stops with this status.
  BatchControl(uint64_t max_work, std::function<absl::Status()> stop);
  ~BatchControl();

  // Adds `work` to the work done. Returns false if the batch must end, because the work budget is used up or because
  // `stop`, which this function calls, has returned an error.
  bool report_work(uint64_t work);
  // Returns whether the work budget is used up.
  bool out_of_work() const { return max_work_ != 0 && done_.load(std::memory_order_relaxed) >= max_work_; }
  // Returns the status that stopped the batch, or OK. Call it only after all threads have finished.
  absl::Status status() const { return status_; }
  bool stopped() const { return stopped_.load(std::memory_order_acquire); }

  // Returns the boxes of `objects`, or null if they are not built. Builds them once `rays` of this and earlier calls
  // sum up to half the number of objects, so that the build never costs much more than the searches of the grid before
  // it. All calls must have the same `objects`. The result belongs to this object.
  const ObjectBoxes* object_boxes(const ObjectSet& objects, size_t rays);

 private:
  const uint64_t max_work_;
  const std::function<absl::Status()> stop_;
  std::atomic<uint64_t> done_ = 0;
  std::atomic<bool> stopping_ = false;
  std::atomic<bool> stopped_ = false;
  absl::Status status_;  // written once, by the thread that set stopping_, before it sets stopped_
  std::atomic<uint64_t> beam_rays_ = 0;
  std::unique_ptr<const ObjectBoxes> built_boxes_;  // written once, by the thread that builds the boxes
  std::atomic<const ObjectBoxes*> boxes_ = nullptr;
};

class QueryTask {
 public:
  // Borrows `snapshot` and `control`. With `brute_force` every search tests all values instead of using index
  // structures.
  QueryTask(const SceneSnapshot& snapshot, BatchControl& control, bool brute_force)
      : snapshot_(snapshot), control_(control), brute_force_(brute_force) {}

  const SceneSnapshot& snapshot() const { return snapshot_; }
  Work& work() { return work_; }

  // Counts one primitive test; call it before each test. Returns false if the query must end now with a truncated
  // result.
  bool count_test() {
    if (++tests_ % limits::kTestsBetweenChecks != 0) return !ended_;
    return check();
  }
  // Counts `tests` primitive tests in one call. Returns false if the query must end now, like count_test().
  bool count_tests(uint64_t tests) {
    const uint64_t before = tests_ / limits::kTestsBetweenChecks;
    tests_ += tests;
    return tests_ / limits::kTestsBetweenChecks == before ? !ended_ : check();
  }
  // Reports the work since the last check() to the BatchControl, which checks the budget and calls `stop`. Returns
  // !ended().
  bool check();
  bool ended() const { return ended_; }

  // Returns the vector kernels for EXACT rays in meshes, or null if the active instruction set has none or the task
  // uses brute force.
  const RayKernels* ray_kernels() const { return brute_force_ ? nullptr : active_ray_kernels(); }

  // Returns the boxes of the latest objects for `rays` more rays, or null if the grid should be searched: see
  // BatchControl::object_boxes().
  const ObjectBoxes* object_boxes(size_t rays) { return control_.object_boxes(snapshot_.objects, rays); }

  // Returns the collector of found objects, which successive overlap and contains queries reuse.
  FoundObjects& found_objects() { return found_objects_; }

  // Returns whether ball, box, contains, nearest and pair queries may use the vector kernels.
  bool uses_kernels() const { return !brute_force_; }
  // Returns whether lookups test all values instead of using the tables of ids and groups.
  bool brute_force() const { return brute_force_; }

  // Call the visitor for every value of `index` that may match the query: the values that the index structure finds,
  // or, with brute force, all values.
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
  void visit_path(const Index& index, const PathBoxes& path, Visitor& visitor) {
    if (brute_force_)
      visit_all(index, visitor);
    else
      index.visit_path(path, visitor, work_);
  }
  template <class Visitor>
  void visit_half_line(const TriangleBvh& tree, const HalfLineBoxes& line, Visitor& visitor) {
    if (brute_force_)
      visit_all(tree, visitor);
    else
      tree.visit_half_line(line, visitor, work_);
  }
  template <class Index, class Visitor>
  void visit_nearest(const Index& index, const Vec3d& point, Visitor& visitor) {
    if (brute_force_)
      visit_all(index, visitor);
    else
      index.visit_nearest(point, visitor, work_);
  }

  // Call the visitor for every object at `moment` that may match the query, or, with brute force, for all objects.
  template <class Visitor>
  void visit_objects_on_ray(const SceneAtTime& moment, const SlabRay<double>& slabs, Visitor& visitor) {
    const auto visit = [&visitor](const GridRef& object) { return visitor.visit(object); };
    if (brute_force_)
      visit_all_objects(moment, visit);
    else
      moment.visit_ray(
          slabs, [&visitor] { return std::as_const(visitor).limit(); }, work_, visit);
  }
  template <class Visitor>
  void visit_objects_near(const SceneAtTime& moment, const Vec3d& point, Visitor& visitor) {
    const auto visit = [&visitor](const GridRef& object) { return visitor.visit(object); };
    if (brute_force_)
      visit_all_objects(moment, visit);
    else
      moment.visit_nearest(
          point, [&visitor] { return std::as_const(visitor).limit(); }, work_, visit);
  }
  template <class Visitor>
  void visit_objects_in_region(const SceneAtTime& moment, Visitor& visitor) {
    const auto visit = [&visitor](const GridRef& object) { return visitor.visit(object); };
    if (brute_force_) return visit_all_objects(moment, visit);
    const Aabbd bounds = std::as_const(visitor).bounds();
    const auto search = [&](const auto& visit_one) {
      if (walk_) return walk_->visit(work_, visit_one);
      std::as_const(visitor).region().visit(work_, visit_one);
    };
    moment.visit_asked(bounds, work_, search, visit);
  }
  // Starts a RegionWalk over the grid regions of queries [begin, end). After this call, visit_objects_in_region() must
  // be called once for each of these queries, in order. visit_objects_in_region() then searches the region of the walk
  // instead of the region of the visitor. While one region is visited, the walk prefetches the memory of the following
  // regions.
  void walk_regions(size_t begin, size_t end, const std::function<GridRegion(size_t)>& region_of) {
    LOCUS_DCHECK_LT(begin, end);
    walk_.emplace(begin, end, region_of);
  }

 private:
  // Call the visitor for every value, and count a test of each, as the index structures do.
  template <class Value, class Visitor>
  void visit_all(const Bvh<Value>& index, Visitor& visitor) {
    for (const Value& value : index.values()) {
      ++work_.tests;
      if (!visitor.visit(value)) return;
    }
  }
  template <class Index, class Visitor>
  void visit_all(const Index& index, Visitor& visitor) {
    bool more = true;
    index.for_each([&](const auto& value) {
      if (!more) return;
      ++work_.tests;
      more = visitor.visit(value);
    });
  }
  template <class Visit>
  void visit_all_objects(const SceneAtTime& moment, const Visit& visit) {
    moment.objects().grid().for_each([&](const GridRef& object) {
      ++work_.tests;
      return visit(object);
    });
  }

  const SceneSnapshot& snapshot_;
  BatchControl& control_;
  const bool brute_force_;
  Work work_;
  std::optional<RegionWalk> walk_;  // set by walk_regions()
  FoundObjects found_objects_;
  uint64_t tests_ = 0;          // number of primitive tests counted by count_test() and count_tests()
  uint64_t reported_work_ = 0;  // part of work_ that was reported to control_
  bool ended_ = false;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_QUERY_TASK_H_
