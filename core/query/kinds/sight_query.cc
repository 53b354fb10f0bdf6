#include "core/query/kinds/sight_query.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/query/kinds/instance_rays.h"
#include "core/query/kinds/kernel_rays.h"

namespace locus {
namespace {

// Maximum number of segments in one call of a kernel or of find_hits(), which cannot be interrupted.
constexpr size_t kMaxSegmentsAtOnce = 128;

// Segment from an eye to a sample point.
struct Segment {
  uint32_t target;  // index of the target's byte in the answer
  uint32_t sample;  // index of the sample point in the block
  Vec3d way;        // from the eye to the sample
  uint32_t hint;    // block of triangles of the searched mesh that probably blocks the segment, or kNoBlock
  bool is_blocked = false;
};

// One viewer of a block: computes the filters, vectors and rays of its segments.
class Viewer {
 public:
  Viewer(const QueryBlock& block, const SightColumns& sight, size_t index)
      : block_(block),
        sight_(sight),
        index_(index),
        group_(planted(PlantedBug::kOwnGroupBlocks) ? 0
                                                    : ColumnReader<uint64_t>(sight.viewer_groups, 1).value(index, 0)),
        filter_(block, index),
        max_distance_(
            ColumnReader<float>(sight.max_distances, 1).value(index, std::numeric_limits<float>::infinity())) {}

  Group group_of(uint32_t target) const {
    const ColumnReader<uint64_t> groups(sight_.target_groups, 1);
    return groups.value(sight_.pairwise ? index_ : target, 0);
  }
  // Returns the filter of the segments to a target. Objects and instances that the filter accepts block each segment
  // that they intersect.
  Filter filter_of(uint32_t target) const {
    Filter filter = filter_;
    filter.ignore(group_, group_of(target));
    return filter;
  }
  // Returns a filter that accepts every object and instance that may block a segment of the viewer, to any target.
  Filter filter() const {
    Filter filter = filter_;
    filter.ignore(group_, 0);
    return filter;
  }

  // Returns the index, within the block, of sample `k` of a target.
  uint32_t sample_of(uint32_t target, size_t k) const {
    const size_t samples = sight_.samples_per_target(), first = sight_.pairwise ? index_ * samples : 0;
    return static_cast<uint32_t>(first + target * samples + k);
  }
  // Returns the vector from an eye to a sample.
  Vec3d way(Vec3d eye, uint32_t sample) const {
    return block_.frame + read_vec3d(&sight_.targets[size_t{3} * sample]) - eye;
  }
  // Returns whether a sample at the end of `way` is near enough to be seen.
  bool reaches(Vec3d way) const { return std::sqrt(squared_length(way)) <= double{max_distance_}; }

  // Returns the ray of mode ANY for the segment from `eye` to `eye` + `way`: the segment is blocked if the ray has a
  // hit.
  RayRequest request(Vec3d eye, Vec3d way, Source source) const {
    RayRequest request{};
    request.origin = eye;
    request.direction = way;
    request.t_max = 1;
    request.mode = RayMode::kAny;
    request.source = source;
    request.precision = block_.precision;
    request.max_results = 1;
    return request;
  }

 private:
  const QueryBlock& block_;
  const SightColumns& sight_;
  const size_t index_;
  const Group group_;
  const Filter filter_;
  const float max_distance_;
};

// Search of the segments of one viewer, eye after eye. A sample that one eye sees is not searched again for the
// following eyes. All segments of an eye start at the same point, so the eye is transformed to the axes of a mesh only
// once. Neighbouring segments are often blocked by the same triangles, so the block of triangles that blocked a
// previous segment is tested first. This hint affects only the order of the tests, not the answer.
class Look {
 public:
  Look(QueryTask& task, const SceneAtTime& moment, const QueryBlock& block, const SightColumns& sight, size_t viewer)
      : task_(task), moment_(moment), block_(block), sight_(sight), viewer_(block, sight, viewer) {}

  // Counts the samples that are seen from `eye` and were not seen from a previous eye.
  void from(Vec3d eye, absl::Span<char> seen) {
    eye_ = eye;
    gather(seen);
    if (uses_kernels()) {
      for (const Instance& instance : moment_.statics().tree().values()) trace(instance);
    } else if (block_.source != Source::kDynamic) {
      search_rays(Source::kStatic);
    }
    std::erase_if(segments_, [](const Segment& segment) { return segment.is_blocked; });
    if (block_.source != Source::kStatic && moment_.objects().grid().size() != 0) {
      search_rays(Source::kDynamic);
      std::erase_if(segments_, [](const Segment& segment) { return segment.is_blocked; });
    }
    if (task_.ended()) return;
    for (const Segment& segment : segments_) see(segment.target, segment.sample, seen);
  }

 private:
  // If the scene has at most this number of instances, all segments are tested against each instance. Otherwise each
  // segment searches the tree over instances.
  static constexpr size_t kFewInstances = 8;
  // Initial number of segments per kernel call in the first pass of trace(), which tests one segment per target. If a
  // call finds a blocked segment, the block of triangles that blocks the segment becomes the hint for the next calls.
  // The number doubles after each call that finds no blocked segment, because kernels are faster with many segments.
  static constexpr size_t kSegmentsAtOnce = 16;

  bool uses_kernels() const {
    return block_.precision == Precision::kExact && block_.source != Source::kDynamic &&
           task_.ray_kernels() != nullptr && moment_.statics().size() <= kFewInstances;
  }

  void see(uint32_t target, uint32_t sample, absl::Span<char> seen) {
    ++seen[target];
    if (sight_.eyes_per_viewer() > 1) is_seen_[sample] = 1;
  }

  // Collects the segments from the eye to the samples that are not seen yet. Segments of the same target stay together,
  // and targets in similar directions are neighbours. Samples at the eye itself count as seen. Samples farther away
  // than max_distance_ are not seen.
  void gather(absl::Span<char> seen) {
    segments_.clear();
    if (sight_.eyes_per_viewer() > 1 && is_seen_.empty()) is_seen_.resize(sight_.targets.size() / 3);
    for (uint32_t target = 0; target < seen.size(); ++target) {
      for (size_t k = 0; k < sight_.samples_per_target(); ++k) {
        const uint32_t sample = viewer_.sample_of(target, k);
        if (!is_seen_.empty() && is_seen_[sample] != 0) continue;
        const Vec3d way = viewer_.way(eye_, sample);
        if (way == Vec3d{})
          see(target, sample, seen);
        else if (viewer_.reaches(way))
          segments_.push_back({target, sample, way, kNoBlock});
      }
    }
    sort_by_direction();
  }

  // Sorts the segments by the direction of their target's first segment. Each direction crosses one face of a cube
  // around the eye. The segments are sorted by this face, then along a Morton curve through the 8 x 8 squares of the
  // face.
  void sort_by_direction() {
    constexpr size_t kFew = 32;
    if (segments_.size() < kFew) return;
    keys_.clear();
    for (size_t i = 0; i < segments_.size(); ++i) {
      const bool starts = i == 0 || segments_[i].target != segments_[i - 1].target;
      const uint32_t key = starts ? direction_key(segments_[i].way) : static_cast<uint32_t>(keys_.back() >> 32);
      keys_.push_back(uint64_t{key} << 32 | i);
    }
    std::sort(keys_.begin(), keys_.end());
    sorted_.clear();
    for (const uint64_t key : keys_) sorted_.push_back(segments_[static_cast<uint32_t>(key)]);
    segments_.swap(sorted_);
  }

  static uint32_t direction_key(Vec3d way) {
    const Vec3d size = abs(way);
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const auto cell = [&](int other) {
      const double part = (way[other] / size[axis] + 1) * 4;
      return static_cast<uint32_t>(std::clamp(part, 0.0, 7.0));
    };
    uint32_t curve = 0;
    for (uint32_t bit = 0; bit < 3; ++bit)
      curve |= (cell(u) >> bit & 1u) << (2 * bit) | (cell(v) >> bit & 1u) << (2 * bit + 1);
    return (static_cast<uint32_t>(axis) * 2 + (way[axis] < 0 ? 1u : 0u)) << 6 | curve;
  }

  // Tests the segments that are not blocked yet against one instance: first one segment of each target, then the other
  // segments. The hint of these other segments is the block of triangles that blocked the first segment of the same
  // target.
  void trace(const Instance& instance) {
    if (task_.ended() || !task_.count_test() || !viewer_.filter().accepts(instance)) return;
    open_.clear();
    for (uint32_t i = 0; i < segments_.size(); ++i) {
      Segment& segment = segments_[i];
      segment.hint = kNoBlock;
      if (!segment.is_blocked && (instance.group == 0 || instance.group != viewer_.group_of(segment.target)))
        open_.push_back(i);
    }
    const Vec3d origin = instance.transform.point_to_mesh(eye_);
    uint32_t hint = kNoBlock;
    // Trace, for each target, the first of its segments in open_.
    now_.clear();
    const auto starts_target = [&](size_t k) {
      return k == 0 || segments_[open_[k]].target != segments_[open_[k - 1]].target;
    };
    size_t at_once = kSegmentsAtOnce;
    for (size_t k = 0; k < open_.size(); ++k) {
      if (!starts_target(k)) continue;
      segments_[open_[k]].hint = hint;
      now_.push_back(open_[k]);
      if (now_.size() < at_once) continue;
      const uint32_t found = trace(instance, origin, kNoBlock);
      at_once = found == kNoBlock ? std::min(2 * at_once, kMaxSegmentsAtOnce) : kSegmentsAtOnce;
      if (found != kNoBlock) hint = found;
      now_.clear();
    }
    trace(instance, origin, hint);
    // Trace the remaining segments in open_.
    now_.clear();
    uint32_t first = 0;
    for (size_t k = 0; k < open_.size(); ++k) {
      if (starts_target(k)) {
        first = open_[k];
        continue;
      }
      segments_[open_[k]].hint = segments_[first].hint;
      now_.push_back(open_[k]);
      if (now_.size() < kMaxSegmentsAtOnce) continue;
      trace(instance, origin, hint);
      now_.clear();
    }
    trace(instance, origin, hint);
  }

  // Tests the segments of now_ against one instance by a kernel. Sets the hint of a blocked segment to the block of
  // triangles that blocks it. Returns the hint of the last segment that the kernel found blocked, or `hint` if the
  // kernel found no segment blocked.
  uint32_t trace(const Instance& instance, Vec3d origin, uint32_t hint) {
    if (now_.empty() || task_.ended()) return hint;
    const TriangleTree tree = instance.mesh->tree().tree();
    const double extent = max_component(abs(origin)) + double{tree.magnitude};
    const bool is_within = contains(instance.bounds, eye_);
    kernel_rays_.clear();
    kernel_segments_.clear();
    for (const uint32_t i : now_) {
      Segment& segment = segments_[i];
      float nearest = 0;
      if (!is_within) {
        const SlabRay<double> slabs(Rayd{eye_, segment.way}, kInstancePad);
        const std::optional<float> entered = entry(slabs, instance.bounds);
        if (!entered || *entered > 1) continue;
        nearest = *entered;
      }
      const Vec3d direction = instance.transform.direction_to_mesh(segment.way);
      const double longest = max_component(abs(direction));
      if (!(longest >= kMinKernelDirection && longest <= kMaxKernelDirection && extent >= kMinKernelReach &&
            extent <= kMaxKernelReach)) {
        trace_one(instance, nearest, segment);
        continue;
      }
      kernel_rays_.push_back({{origin.x, origin.y, origin.z},
                              {direction.x, direction.y, direction.z},
                              1,
                              true,
                              true,
                              instance.transform.quaternion.is_identity(),
                              segment.hint});
      kernel_segments_.push_back({i, nearest});
    }
    return run_kernel(instance, tree, hint);
  }

  uint32_t run_kernel(const Instance& instance, const TriangleTree& tree, uint32_t hint) {
    if (kernel_rays_.empty()) return hint;
    hits_.resize(kernel_rays_.size());
    task_.ray_kernels()->any(tree, kernel_rays_.data(), hits_.data(), hits_.size());
    uint64_t tests = 0;
    for (const KernelHit& hit : hits_) {
      task_.work().nodes += hit.nodes;
      tests += hit.tests;
    }
    task_.work().tests += tests;
    task_.count_tests(tests);
    for (size_t k = 0; k < hits_.size(); ++k) {
      const KernelHit& hit = hits_[k];
      Segment& segment = segments_[kernel_segments_[k].index];
      segment.hint = kNoBlock;
      if (hit.verdict == KernelVerdict::kMiss) continue;
      if (hit.verdict == KernelVerdict::kUndecided || hit.t < kernel_segments_[k].nearest) {
        trace_one(instance, kernel_segments_[k].nearest, segment);
        continue;
      }
      segment.is_blocked = true;
      hint = segment.hint = hit.number;
    }
    return hint;
  }

  // Tests one segment against one instance, triangle by triangle. `nearest` is the t at which the segment enters the
  // instance's bounds.
  void trace_one(const Instance& instance, float nearest, Segment& segment) {
    const SlabRay<double> slabs(Rayd{eye_, segment.way}, kInstancePad);
    const RayRequest request = viewer_.request(eye_, segment.way, Source::kStatic);
    HitCollector collector(request);
    trace_instance(task_, request, slabs, instance, nearest, collector);
    segment.is_blocked = collector.done();
  }

  // Searches the segments as rays of mode ANY among the instances or the objects.
  void search_rays(Source source) {
    for (size_t begin = 0; begin < segments_.size() && !task_.ended(); begin += kMaxSegmentsAtOnce) {
      const size_t end = std::min(segments_.size(), begin + kMaxSegmentsAtOnce);
      rays_.clear();
      for (size_t i = begin; i < end; ++i)
        rays_.emplace_back(viewer_.request(eye_, segments_[i].way, source), viewer_.filter_of(segments_[i].target));
      find_hits(task_, rays_, [this](size_t) -> const SceneAtTime& { return moment_; });
      for (size_t i = begin; i < end; ++i) segments_[i].is_blocked = rays_[i - begin].collector.done();
    }
  }

  struct KernelSegment {
    uint32_t index;  // in segments_
    float nearest;   // t at which the segment enters the bounds of the instance
  };

  QueryTask& task_;
  const SceneAtTime& moment_;
  const QueryBlock& block_;
  const SightColumns& sight_;
  const Viewer viewer_;
  Vec3d eye_;
  std::vector<uint8_t> is_seen_;  // for each sample point; only for viewers with several eyes
  std::vector<Segment> segments_, sorted_;
  std::vector<uint64_t> keys_;
  std::vector<uint32_t> open_, now_;  // indices in segments_
  std::vector<KernelRay> kernel_rays_;
  std::vector<KernelSegment> kernel_segments_;
  std::vector<KernelHit> hits_;
  std::vector<PendingRay> rays_;
};

}  // namespace

void look(QueryTask& task, const SceneAtTime& moment, const QueryBlock& block, const SightColumns& sight, Vec3d origin,
          size_t i, absl::Span<char> seen) {
  LOCUS_DCHECK_EQ(seen.size(), sight.bytes_per_viewer());
  Look look(task, moment, block, sight, i);
  const size_t eyes = sight.eyes_per_viewer();
  for (size_t eye = 0; eye < eyes && !task.ended(); ++eye)
    look.from(origin + read_vec3d(&sight.viewers[3 * (i * eyes + eye)]), seen);
}

size_t viewers_together(const SightColumns& sight) {
  constexpr size_t kFewSegments = 8;
  const size_t segments = sight.bytes_per_viewer() * sight.samples_per_target();
  return sight.eyes_per_viewer() == 1 && segments > 0 && segments <= kFewSegments ? kMaxSegmentsAtOnce / segments : 0;
}

void look_together(QueryTask& task, const QueryBlock& block, const SightColumns& sight,
                   absl::Span<const SightQuery> queries) {
  std::vector<PendingRay> rays;
  std::vector<std::pair<size_t, char*>> owners;  // for each ray its query, and the byte of its target
  for (size_t query = 0; query < queries.size(); ++query) {
    const SightQuery& now = queries[query];
    const Viewer viewer(block, sight, now.viewer);
    const Vec3d eye = now.origin + read_vec3d(&sight.viewers[3 * now.viewer]);
    for (uint32_t target = 0; target < now.seen.size(); ++target) {
      for (size_t k = 0; k < sight.samples_per_target(); ++k) {
        const Vec3d way = viewer.way(eye, viewer.sample_of(target, k));
        if (way == Vec3d{}) {
          ++now.seen[target];
        } else if (viewer.reaches(way)) {
          rays.emplace_back(viewer.request(eye, way, block.source), viewer.filter_of(target));
          owners.emplace_back(query, &now.seen[target]);
        }
      }
    }
  }
  find_hits(task, rays, [&](size_t ray) -> const SceneAtTime& { return *queries[owners[ray].first].moment; });
  if (task.ended()) return;
  for (size_t ray = 0; ray < rays.size(); ++ray)
    if (!rays[ray].collector.done()) ++*owners[ray].second;
}

}  // namespace locus
