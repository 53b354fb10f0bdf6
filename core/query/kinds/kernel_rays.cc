#include "core/query/kinds/kernel_rays.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>

#include "core/base/check.h"
#include "core/query/kinds/instance_rays.h"

namespace locus {
namespace {

// Maximum number of hits that the kernels return for one kAll ray in one mesh. This maximum bounds the size of rows_. A
// ray that may have more hits is traced triangle by triangle instead.
constexpr uint32_t kMaxRows = 128;

// Pair of a ray and the instance that the ray has reached. The ray is not tested against the instance's triangles yet.
struct Stop {
  uint32_t ray;   // index in Rounds::rays_
  float nearest;  // t at which the ray enters the bounds of the instance
  const Instance* instance;
};

// Traversal of all rays of one trace_meshes() call. Each round traces all rays that wait at a stop, then advances each
// of these rays to its next stop. Invariant: between rounds each ray has at most one stop.
class Rounds {
  using InstanceWalk = Bvh<Instance>::RayWalk;

 public:
  // statics_of(i) returns the instances at the time of ray i.
  template <class StaticsOf>
  Rounds(QueryTask& task, std::vector<PendingRay>& rays, const StaticsOf& statics_of) : task_(task), rays_(rays) {
    LOCUS_DCHECK(task.ray_kernels() != nullptr);
    for (const PendingRay& ray : rays) LOCUS_DCHECK(ray.request.mode == mode());
    const Bvh<Instance>& first = statics_of(0).tree();
    bool is_only = first.size() == 1;
    for (size_t i = 1; i < rays.size() && is_only; ++i) is_only = &statics_of(i).tree() == &first;
    if (is_only) only_ = &*first.values().begin();
    slabs_.reserve(rays.size());
    for (const PendingRay& ray : rays)
      slabs_.emplace_back(Rayd{ray.request.origin, ray.request.direction}, kInstancePad);
    walks_.reserve(only_ == nullptr ? rays.size() : 0);
    if (only_ == nullptr)
      for (size_t i = 0; i < rays.size(); ++i) walks_.emplace_back(statics_of(i).tree(), slabs_[i]);
    stops_.reserve(rays.size());
    if (mode() != RayMode::kAll) return;
    // One row more than requested shows that the result is truncated. With count_only, max_results has no effect.
    const RayRequest& request = rays.front().request;
    max_rows_ = request.count_only ? kMaxRows : std::min(kMaxRows, request.max_results + 1);
    rows_ = std::make_unique_for_overwrite<KernelRow[]>(rays.size() * max_rows_);
  }

  void run() {
    for (uint32_t ray = 0; ray < rays_.size(); ++ray) {
      if (only_ == nullptr)
        walk_on(ray);
      else
        walk_to_only(ray);
    }
    while (!stops_.empty() && !task_.ended()) {
      current_.swap(stops_);
      LOCUS_DCHECK_LE(current_.size(), rays_.size());
      stops_.clear();
      sort_by_tree();
      for (size_t first = 0; first < current_.size();) first = trace_tree(first);
      if (only_ != nullptr) return;
      for (const Stop& stop : current_) walk_on(stop.ray);
    }
  }

 private:
  RayMode mode() const { return rays_.front().request.mode; }

  // Advances ray `index` to the next instance that the ray's filter accepts and whose bounds the ray enters within the
  // limit of the ray's collector. Adds a stop at this instance, or adds no stop if no such instance is left.
  void walk_on(uint32_t index) {
    PendingRay& ray = rays_[index];
    InstanceWalk& walk = walks_[index];
    while (!task_.ended() && !ray.collector.done()) {
      const Instance* const instance = walk.next(raised(ray.collector.limit()), task_.work());
      if (instance == nullptr) return;
      if (!task_.count_test()) return;
      if (!ray.filter.accepts(*instance)) continue;
      // A ray hits an instance only if the ray enters the instance's bounds, and no hit has a lower t than the entry.
      // This test is repeated here because the tree over instances may or may not cull by these bounds, and the result
      // must not depend on culling.
      const std::optional<float> nearest = entry(slabs_[index], instance->bounds);
      if (!nearest || *nearest > ray.collector.limit()) continue;
      return stops_.push_back({index, *nearest, instance});
    }
  }

  // Adds a stop of ray `index` at the only instance of the scene if the ray enters the instance's bounds and the ray's
  // filter accepts the instance.
  void walk_to_only(uint32_t index) {
    PendingRay& ray = rays_[index];
    if (task_.ended()) return;
    const std::optional<float> nearest = entry(slabs_[index], only_->bounds);
    if (!nearest || *nearest > ray.collector.limit()) return;
    ++task_.work().tests;
    if (!task_.count_test() || !ray.filter.accepts(*only_)) return;
    stops_.push_back({index, *nearest, only_});
  }

  void sort_by_tree() {
    const auto tree = [](const Stop& stop) { return &stop.instance->mesh->tree(); };
    const auto other = [&](const Stop& a, const Stop& b) { return tree(a) != tree(b); };
    if (std::adjacent_find(current_.begin(), current_.end(), other) == current_.end()) return;
    std::stable_sort(current_.begin(), current_.end(),
                     [&](const Stop& a, const Stop& b) { return std::less<>()(tree(a), tree(b)); });
  }

  // Traces the rays of stop `first` and of the stops after it whose instances have the same tree as the instance of
  // stop `first`; meshes with equal contents share one tree. Returns the index of the first stop with another tree.
  size_t trace_tree(size_t first) {
    const TriangleBvh& tree = current_[first].instance->mesh->tree();
    if (kernel_rays_.size() < current_.size()) kernel_rays_.resize(current_.size());
    kernel_stops_.clear();
    size_t last = first;
    for (; last < current_.size() && &current_[last].instance->mesh->tree() == &tree; ++last) {
      if (set_kernel_ray(current_[last], kernel_rays_[kernel_stops_.size()]))
        kernel_stops_.push_back(last);
      else
        trace_triangles(current_[last]);
    }
    run_kernels(tree.tree());
    return last;
  }

  void run_kernels(const TriangleTree& tree) {
    if (kernel_stops_.empty()) return;
    hits_.resize(kernel_stops_.size());
    const RayKernels& kernels = *task_.ray_kernels();
    if (mode() == RayMode::kAll)
      kernels.all(tree, kernel_rays_.data(), hits_.data(), hits_.size(), rows_.get(), max_rows_);
    else
      (mode() == RayMode::kAny ? kernels.any : kernels.first)(tree, kernel_rays_.data(), hits_.data(), hits_.size());
    LOCUS_DCHECK_LE(kernel_stops_.size(), kernel_rays_.size());
    uint64_t tests = 0;
    for (size_t i = 0; i < kernel_stops_.size(); ++i) {
      task_.work().nodes += hits_[i].nodes;
      tests += hits_[i].tests;
    }
    task_.work().tests += tests;
    task_.count_tests(tests);
    for (size_t i = 0; i < kernel_stops_.size(); ++i) {
      if (mode() == RayMode::kAll)
        offer_all(current_[kernel_stops_[i]], hits_[i], rows_.get() + i * max_rows_);
      else
        offer_hit(current_[kernel_stops_[i]], hits_[i]);
    }
  }

  void offer_hit(const Stop& stop, const KernelHit& found) {
    if (found.verdict == KernelVerdict::kMiss) return;
    if (found.verdict == KernelVerdict::kUndecided || found.t < stop.nearest) return trace_triangles(stop);
    Hit hit = hit_on(*stop.instance, found.t);
    hit.triangle = found.number;
    rays_[stop.ray].collector.offer(hit);
  }

  void offer_all(const Stop& stop, const KernelHit& found, const KernelRow* rows) {
    if (found.verdict == KernelVerdict::kMiss) return;
    PendingRay& ray = rays_[stop.ray];
    const bool may_be_more =
        found.number == max_rows_ && (ray.request.count_only || max_rows_ <= ray.request.max_results);
    const KernelRow* const end = rows + found.number;
    const auto before = [&](const KernelRow& row) { return row.t < stop.nearest; };
    if (found.verdict == KernelVerdict::kUndecided || may_be_more || std::any_of(rows, end, before))
      return trace_triangles(stop);
    LOCUS_DCHECK_LE(found.number, max_rows_);
    for (; rows != end; ++rows) {
      Hit hit = hit_on(*stop.instance, rows->t);
      hit.triangle = rows->number;
      ray.collector.offer(hit);
    }
  }

  // Tests the ray of `stop` against the triangles of the instance of `stop` one at a time, without the kernels.
  void trace_triangles(const Stop& stop) {
    PendingRay& ray = rays_[stop.ray];
    trace_instance(task_, ray.request, slabs_[stop.ray], *stop.instance, stop.nearest, ray.collector);
  }

  // Sets `to` to the ray of `stop` in mesh axes. Returns false if the direction or the coordinates lie outside the
  // range that the kernels support. Writes the members in place, because copying a ray right after it was written in
  // parts would stall the processor.
  bool set_kernel_ray(const Stop& stop, KernelRay& to) const {
    const PendingRay& ray = rays_[stop.ray];
    const Transform& transform = stop.instance->transform;
    const Vec3d origin = transform.point_to_mesh(ray.request.origin);
    const Vec3d direction = transform.direction_to_mesh(ray.request.direction);
    const double max_direction = max_component(abs(direction));
    const double extent = max_component(abs(origin)) + double{stop.instance->mesh->tree().tree().magnitude};
    if (!(max_direction >= kMinKernelDirection && max_direction <= kMaxKernelDirection)) return false;
    if (!(extent >= kMinKernelReach && extent <= kMaxKernelReach)) return false;
    for (int axis = 0; axis < 3; ++axis) {
      to.origin[axis] = origin[axis];
      to.direction[axis] = direction[axis];
    }
    to.limit = ray.collector.limit();
    to.accept_front = ray.request.cull != Cull::kFront;
    to.accept_back = ray.request.cull != Cull::kBack;
    to.unrotated = transform.quaternion.is_identity();
    return true;
  }

  QueryTask& task_;
  std::vector<PendingRay>& rays_;
  std::vector<SlabRay<double>> slabs_;  // one per ray
  const Instance* only_ = nullptr;      // the only instance of the scene, if there is exactly one
  std::vector<InstanceWalk> walks_;     // one per ray, if there are several instances
  std::vector<Stop> stops_, current_;   // stops_: stops of the next round; current_: stops of the current round
  std::vector<KernelRay> kernel_rays_;
  std::vector<size_t> kernel_stops_;  // for each of kernel_rays_, the index of its stop in current_
  std::vector<KernelHit> hits_;
  uint32_t max_rows_ = 0;  // kAll: number of entries in rows_ for each of kernel_rays_
  std::unique_ptr<KernelRow[]> rows_;
};

}  // namespace

void trace_meshes(QueryTask& task, std::vector<PendingRay>& rays,
                  absl::FunctionRef<const SceneAtTime&(size_t)> moment_of) {
  const auto statics_of = [&](size_t ray) -> const StaticSet& { return moment_of(ray).statics(); };
  for (size_t i = 0; i < rays.size(); ++i)
    if (statics_of(i).size() != 0) return Rounds(task, rays, statics_of).run();
}

}  // namespace locus
