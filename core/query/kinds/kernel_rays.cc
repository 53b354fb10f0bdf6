#include "core/query/kinds/kernel_rays.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>

#include "core/query/kinds/instance_rays.h"

namespace locus {
namespace {

// Rows of kAll that a ray gets of one mesh by the kernels; a ray that may have more goes triangle by triangle. Bounds
// memory.
constexpr uint32_t kMaxRows = 128;

// An instance that a ray has come to.
struct Stop {
  uint32_t ray;
  float nearest;  // where the ray enters its bounds
  const Instance* instance;
};

class Round {
  using InstanceWalk = Bvh<Instance>::RayWalk;

 public:
  Round(QueryTask& task, std::vector<AskedRay>& rays) : task_(task), rays_(rays) {
    const Bvh<Instance>& instances = task.snapshot().statics->tree();
    if (instances.size() == 1) only_ = instances.values().data();
    slabs_.reserve(rays.size());
    for (const AskedRay& ray : rays) slabs_.emplace_back(Rayd{ray.request.origin, ray.request.direction}, kInstancePad);
    walks_.reserve(only_ == nullptr ? rays.size() : 0);
    if (only_ == nullptr)
      for (const SlabRay<double>& slabs : slabs_) walks_.emplace_back(instances, slabs);
    stops_.reserve(rays.size());
    if (mode() != RayMode::kAll) return;
    most_ = std::min(kMaxRows, rays.front().request.max_results + 1);  // one more tells whether there are more
    rows_ = std::make_unique_for_overwrite<KernelRow[]>(rays.size() * most_);
  }

  void run() {
    for (uint32_t ray = 0; ray < rays_.size(); ++ray) {
      if (only_ == nullptr)
        walk_on(ray);
      else
        go_to_only(ray);
    }
    while (!stops_.empty() && !task_.ended()) {
      now_.swap(stops_);
      stops_.clear();
      sort_by_tree();
      for (size_t first = 0; first < now_.size();) first = ask_tree(first);
      if (only_ != nullptr) return;
      for (const Stop& stop : now_) walk_on(stop.ray);
    }
  }

 private:
  RayMode mode() const { return rays_.front().request.mode; }

  // To the next instance that the ray's filter accepts and its limit reaches, if there is one.
  void walk_on(uint32_t number) {
    AskedRay& ray = rays_[number];
    InstanceWalk& walk = walks_[number];
    while (!task_.ended() && !ray.collector.done()) {
      const Instance* const instance = walk.next(raised(ray.collector.limit()), task_.work());
      if (instance == nullptr) return;
      if (!task_.count_test()) return;
      if (!ray.filter.accepts(*instance)) continue;
      // Part of the verdict, and hits are no nearer: the tree over instances may cull by it.
      const std::optional<float> nearest = entry(slabs_[number], instance->bounds);
      if (!nearest || *nearest > ray.collector.limit()) continue;
      return stops_.push_back({number, *nearest, instance});
    }
  }

  // The same where there is one instance: its bounds say at once whether the ray comes to it.
  void go_to_only(uint32_t number) {
    AskedRay& ray = rays_[number];
    if (task_.ended()) return;
    const std::optional<float> nearest = entry(slabs_[number], only_->bounds);
    if (!nearest || *nearest > ray.collector.limit()) return;
    ++task_.work().tests;
    if (!task_.count_test() || !ray.filter.accepts(*only_)) return;
    stops_.push_back({number, *nearest, only_});
  }

  void sort_by_tree() {
    const auto tree = [](const Stop& stop) { return &stop.instance->mesh->tree(); };
    const auto other = [&](const Stop& a, const Stop& b) { return tree(a) != tree(b); };
    if (std::adjacent_find(now_.begin(), now_.end(), other) == now_.end()) return;
    std::stable_sort(now_.begin(), now_.end(),
                     [&](const Stop& a, const Stop& b) { return std::less<const TriangleBvh*>()(tree(a), tree(b)); });
  }

  // Asks all stops at the tree of the first of them, which meshes of equal bytes share. Returns the first stop at
  // another.
  size_t ask_tree(size_t first) {
    const TriangleBvh& tree = now_[first].instance->mesh->tree();
    kernel_rays_.clear();
    asked_.clear();
    size_t last = first;
    for (; last < now_.size() && &now_[last].instance->mesh->tree() == &tree; ++last) {
      const std::optional<KernelRay> ray = kernel_ray(now_[last]);
      if (!ray) {
        ask_triangles(now_[last]);
        continue;
      }
      kernel_rays_.push_back(*ray);
      asked_.push_back(last);
    }
    ask_kernels(tree.tree());
    return last;
  }

  void ask_kernels(const TriangleTree& tree) {
    if (asked_.empty()) return;
    hits_.resize(asked_.size());
    const RayKernels& kernels = *task_.ray_kernels();
    if (mode() == RayMode::kAll)
      kernels.all(tree, kernel_rays_.data(), hits_.data(), hits_.size(), rows_.get(), most_);
    else
      (mode() == RayMode::kAny ? kernels.any : kernels.first)(tree, kernel_rays_.data(), hits_.data(), hits_.size());
    uint64_t tests = 0;
    for (size_t i = 0; i < asked_.size(); ++i) {
      task_.work().nodes += hits_[i].nodes;
      tests += hits_[i].tests;
    }
    task_.work().tests += tests;
    task_.count_tests(tests);
    for (size_t i = 0; i < asked_.size(); ++i) {
      if (mode() == RayMode::kAll)
        take_all(now_[asked_[i]], hits_[i], rows_.get() + i * most_);
      else
        take(now_[asked_[i]], hits_[i]);
    }
  }

  void take(const Stop& stop, const KernelHit& found) {
    if (found.verdict == KernelVerdict::kMiss) return;
    if (found.verdict == KernelVerdict::kUndecided || found.t < stop.nearest) return ask_triangles(stop);
    Hit hit = hit_on(*stop.instance, found.t);
    hit.triangle = found.number;
    rays_[stop.ray].collector.offer(hit);
  }

  void take_all(const Stop& stop, const KernelHit& found, const KernelRow* rows) {
    if (found.verdict == KernelVerdict::kMiss) return;
    AskedRay& ray = rays_[stop.ray];
    const bool may_be_more = found.number == most_ && most_ <= ray.request.max_results;
    const KernelRow* const end = rows + found.number;
    const auto before = [&](const KernelRow& row) { return row.t < stop.nearest; };
    if (found.verdict == KernelVerdict::kUndecided || may_be_more || std::any_of(rows, end, before))
      return ask_triangles(stop);
    for (; rows != end; ++rows) {
      Hit hit = hit_on(*stop.instance, rows->t);
      hit.triangle = rows->number;
      ray.collector.offer(hit);
    }
  }

  void ask_triangles(const Stop& stop) {
    AskedRay& ray = rays_[stop.ray];
    ask_instance(task_, ray.request, slabs_[stop.ray], *stop.instance, stop.nearest, ray.collector);
  }

  // Nothing where the kernels' bounds do not hold.
  std::optional<KernelRay> kernel_ray(const Stop& stop) const {
    const AskedRay& ray = rays_[stop.ray];
    const Transform& transform = stop.instance->transform;
    const Vec3d origin = transform.point_to_mesh(ray.request.origin);
    const Vec3d direction = transform.direction_to_mesh(ray.request.direction);
    const double longest = max_component(abs(direction));
    const double reach = max_component(abs(origin)) + double{stop.instance->mesh->tree().tree().magnitude};
    if (!(longest >= kMinKernelDirection && longest <= kMaxKernelDirection)) return std::nullopt;
    if (!(reach >= kMinKernelReach && reach <= kMaxKernelReach)) return std::nullopt;
    return KernelRay{{origin.x, origin.y, origin.z},  {direction.x, direction.y, direction.z},
                     ray.collector.limit(),           ray.request.cull != Cull::kFront,
                     ray.request.cull != Cull::kBack, transform.quaternion.is_identity()};
  }

  QueryTask& task_;
  std::vector<AskedRay>& rays_;
  std::vector<SlabRay<double>> slabs_;  // of each ray
  const Instance* only_ = nullptr;      // where there is one
  std::vector<InstanceWalk> walks_;     // of each ray, where there are more
  std::vector<Stop> stops_, now_;
  std::vector<KernelRay> kernel_rays_;
  std::vector<size_t> asked_;  // which stop each of kernel_rays_ is
  std::vector<KernelHit> hits_;
  uint32_t most_ = 0;  // kAll: rows of each of kernel_rays_
  std::unique_ptr<KernelRow[]> rows_;
};

}  // namespace

void ask_meshes(QueryTask& task, std::vector<AskedRay>& rays) {
  if (!rays.empty() && task.snapshot().statics->size() != 0) Round(task, rays).run();
}

}  // namespace locus
