#include "tests/bench/static/ours.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/index/bvh/kernels/dispatch.h"
#include "core/index/queries/index_queries.h"
#include "core/query/kinds/triangle_search.h"
#include "tests/bench/frame/results_hash.h"

namespace locus::bench {
namespace {

constexpr size_t kBatch = 1024;      // rays per call of the kernels
constexpr size_t kRegionBatch = 16;  // balls or boxes per call of find_triangles()
constexpr size_t kAllBatch = 256;    // rays per call of the kernel for all hits
constexpr uint32_t kMaxRows = 128;

using AskKernel = void (*)(const TriangleTree& tree, const KernelRay* rays, KernelHit* hits, size_t count);

std::shared_ptr<const StaticMesh> static_mesh(const BenchMesh& mesh) {
  absl::StatusOr<TriangleMesh> valid = TriangleMesh::create(mesh.vertices, mesh.indices, {});
  LOCUS_CHECK(valid.ok());
  auto built = StaticMesh::build(mesh.name, {}, *std::move(valid));
  LOCUS_CHECK(built.ok());
  return *built;
}

// Writes the members in place, because copying a ray right after it was written in parts would stall the processor.
void set(KernelRay& to, const RayQuery& ray) {
  for (int axis = 0; axis < 3; ++axis) {
    to.origin[axis] = ray.origin[axis];
    to.direction[axis] = ray.direction[axis];
  }
  to.limit = ray.t_max;
  to.accept_front = to.accept_back = true;
}

// Returns whether the kernels' error bounds hold for a ray. Directions have unit length, so only `reach` must be
// tested.
bool kernels_hold(const RayQuery& ray, float magnitude) {
  const double reach = double{max_component(abs(ray.origin))} + double{magnitude};
  return reach >= kMinKernelReach && reach <= kMaxKernelReach;
}

TriangleRay triangle_ray(const RayQuery& ray) { return {to_double(ray.origin), to_double(ray.direction)}; }

// Returns the float above t. Callers use it as the limit of a search, because the searches exclude hits at their limit,
// but the workloads include hits at t_max.
float just_beyond(float t) { return std::nextafter(t, std::numeric_limits<float>::infinity()); }

RayAnswer first_by_triangles(const TriangleBvh& tree, const RayQuery& ray) {
  Triangle nearest;
  RayAnswer answer{just_beyond(ray.t_max), kNoTriangle};
  if (first_ray(tree, triangle_ray(ray), nearest, answer.t)) answer.triangle = nearest.number;
  return answer;
}

bool any_by_triangles(const TriangleBvh& tree, const RayQuery& ray) {
  return any_ray(tree, triangle_ray(ray), just_beyond(ray.t_max));
}

// Runs a kernel on batches of rays. Calls `settled` with the index of a ray and its result, or `unsettled` with the
// index if the kernel could not decide.
template <class Settled, class Unsettled>
void ask_kernels(const TriangleBvh& tree, AskKernel ask, absl::Span<const RayQuery> rays, Settled settled,
                 Unsettled unsettled) {
  std::array<KernelRay, kBatch> batch;
  std::array<KernelHit, kBatch> hits;
  const float magnitude = tree.tree().magnitude;
  for (size_t begin = 0; begin < rays.size(); begin += kBatch) {
    const size_t count = std::min(kBatch, rays.size() - begin);
    float largest = 0;
    for (size_t i = 0; i < count; ++i) {
      set(batch[i], rays[begin + i]);
      largest = std::max(largest, max_component(abs(rays[begin + i].origin)));
    }
    ask(tree.tree(), batch.data(), hits.data(), count);
    const bool all_hold = magnitude >= kMinKernelReach && double{largest} + magnitude <= kMaxKernelReach;
    for (size_t i = 0; i < count; ++i) {
      if (hits[i].verdict == KernelVerdict::kUndecided || !(all_hold || kernels_hold(rays[begin + i], magnitude)))
        unsettled(begin + i);
      else
        settled(begin + i, hits[i]);
    }
  }
}

// Writes the numbers of all triangles that one ray hits to `ids`. Returns their number.
uint32_t all_by_triangles(const TriangleBvh& tree, const RayQuery& ray, uint32_t* ids) {
  std::vector<RayHit<Triangle>> found;
  all_rays(tree, triangle_ray(ray), just_beyond(ray.t_max), tree.size(), found);
  for (const RayHit<Triangle>& hit : found) *ids++ = hit.value.number;
  return static_cast<uint32_t>(found.size());
}

// Finds all hits of up to kAllBatch rays by the kernel. Searches the tree instead for each ray that the kernel could
// not decide, that may have more hits than kMaxRows, or for which the kernel's error bounds do not hold. Continues at
// the start of `ids` if the remaining part could be too small for all triangles.
void find_all(const TriangleBvh& tree, const RayKernels& kernels, absl::Span<const RayQuery> rays,
              absl::Span<uint32_t> ids, uint32_t* counts, KernelRow* rows) {
  std::array<KernelRay, kAllBatch> batch;
  std::array<KernelHit, kAllBatch> hits;
  for (size_t i = 0; i < rays.size(); ++i) set(batch[i], rays[i]);
  kernels.all(tree.tree(), batch.data(), hits.data(), rays.size(), rows, kMaxRows);
  size_t used = 0;
  for (size_t i = 0; i < rays.size(); ++i, rows += kMaxRows) {
    if (used > kSpareIds) used = 0;
    const bool settled = hits[i].verdict != KernelVerdict::kUndecided && hits[i].number < kMaxRows &&
                         kernels_hold(rays[i], tree.tree().magnitude);
    if (settled)
      std::transform(rows, rows + hits[i].number, ids.begin() + used, [](const KernelRow& row) { return row.number; });
    counts[i] = settled ? hits[i].number : all_by_triangles(tree, rays[i], ids.data() + used);
    used += counts[i];
  }
}

// Finds the triangles of balls or boxes in batches. Each batch writes from the start of `ids`; queries whose ids do not
// fit are repeated in the next batch.
template <class Shape>
void find_in_batches(const TriangleBvh& tree, absl::Span<const Shape> shapes, absl::Span<uint32_t> ids,
                     uint32_t* counts) {
  while (!shapes.empty()) {
    const absl::Span<const Shape> batch = shapes.subspan(0, kRegionBatch);
    const size_t done = find_triangles(tree, batch, absl::MakeSpan(counts, batch.size()), ids);
    LOCUS_CHECK_LT(size_t{0}, done);
    shapes.remove_prefix(done);
    counts += done;
  }
}

class OurBuilder : public Builder {
 public:
  explicit OurBuilder(const BenchMesh& mesh) : Builder("locus"), mesh_(mesh) {}
  void prepare() override { tree_ = TriangleBvh(); }
  void build() override {
    absl::StatusOr<TriangleBvh> built = TriangleBvh::build(mesh_.triangles);
    LOCUS_CHECK(built.ok());
    tree_ = *std::move(built);
  }
  uint64_t bytes() override { return static_mesh(mesh_)->bytes(); }

 private:
  const BenchMesh& mesh_;
  TriangleBvh tree_;
};

}  // namespace

Ours::Ours(const BenchMesh& mesh) : Peer("locus"), mesh_(static_mesh(mesh)) {}

void Ours::first(absl::Span<const RayQuery> rays, RayAnswer* answers) {
  const TriangleBvh& tree = mesh_->tree();
  const auto by_triangles = [&](size_t i) { answers[i] = first_by_triangles(tree, rays[i]); };
  const RayKernels* const kernels = active_ray_kernels();
  if (kernels == nullptr) {
    for (size_t i = 0; i < rays.size(); ++i) by_triangles(i);
    return;
  }
  const auto settled = [&](size_t i, const KernelHit& hit) {
    answers[i] = {hit.t, hit.verdict == KernelVerdict::kHit ? hit.number : kNoTriangle};
  };
  ask_kernels(tree, kernels->first, rays, settled, by_triangles);
}

void Ours::any(absl::Span<const RayQuery> rays, uint8_t* answers) {
  const TriangleBvh& tree = mesh_->tree();
  const auto by_triangles = [&](size_t i) { answers[i] = any_by_triangles(tree, rays[i]) ? 1 : 0; };
  const RayKernels* const kernels = active_ray_kernels();
  if (kernels == nullptr) {
    for (size_t i = 0; i < rays.size(); ++i) by_triangles(i);
    return;
  }
  const auto settled = [&](size_t i, const KernelHit& hit) { answers[i] = hit.verdict == KernelVerdict::kHit ? 1 : 0; };
  ask_kernels(tree, kernels->any, rays, settled, by_triangles);
}

void Ours::ray_ids(absl::Span<const RayQuery> rays, absl::Span<uint32_t> ids, uint32_t* counts) {
  const TriangleBvh& tree = mesh_->tree();
  const RayKernels* const kernels = active_ray_kernels();
  if (kernels == nullptr) {
    for (const RayQuery& ray : rays) *counts++ = all_by_triangles(tree, ray, ids.data());
    return;
  }
  const auto rows = std::make_unique_for_overwrite<KernelRow[]>(std::min(rays.size(), kAllBatch) * kMaxRows);
  for (size_t begin = 0; begin < rays.size(); begin += kAllBatch)
    find_all(tree, *kernels, rays.subspan(begin, kAllBatch), ids, counts + begin, rows.get());
}

void Ours::ball_ids(absl::Span<const Ballf> balls, absl::Span<uint32_t> ids, uint32_t* counts) {
  find_in_batches(mesh_->tree(), balls, ids, counts);
}

void Ours::box_ids(absl::Span<const Obbf> boxes, absl::Span<uint32_t> ids, uint32_t* counts) {
  find_in_batches(mesh_->tree(), boxes, ids, counts);
}

std::unique_ptr<Builder> our_builder(const BenchMesh& mesh) { return std::make_unique<OurBuilder>(mesh); }

std::string storage_order_hash(const BenchMesh& mesh) {
  const absl::StatusOr<TriangleBvh> tree = TriangleBvh::build(mesh.triangles);
  LOCUS_CHECK(tree.ok());
  ResultsHash hash;
  tree->for_each([&](const Triangle& triangle) { hash.add(triangle.number); });
  return hash.text();
}

}  // namespace locus::bench
