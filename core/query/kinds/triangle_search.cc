#include "core/query/kinds/triangle_search.h"

#include <algorithm>

#include "core/base/check.h"
#include "core/index/regions.h"

namespace locus {
namespace {

Triangle triangle_at(const TriangleBlock& block, uint32_t lane) {
  const auto vertex = [&](int row) {
    return Vec3f{block.vertices[row][lane], block.vertices[row + 1][lane], block.vertices[row + 2][lane]};
  };
  return {vertex(0), vertex(3), vertex(6), 0};
}

bool ball_meets(const void* ball, const TriangleBlock& block, uint32_t lane) {
  return ball_overlaps(*static_cast<const Ballf*>(ball), triangle_at(block, lane));
}

bool box_meets(const void* box, const TriangleBlock& block, uint32_t lane) {
  return box_overlaps(*static_cast<const Obbf*>(box), triangle_at(block, lane));
}

void copy(Vec3f from, float* to) {
  for (int axis = 0; axis < 3; ++axis) to[axis] = from[axis];
}

// Returns an upper bound of the rounding error of `value`, which was rounded from double to float.
float epsilon(float value) { return std::abs(value) * 0x1p-22f + std::numeric_limits<float>::min(); }

// Visitor that writes the indices of overlapping triangles to an array, until an index does not fit. Used for regions
// that no kernel supports.
template <class Shape>
class Collector {
 public:
  using Region = std::conditional_t<std::is_same_v<Shape, Ballf>, BallRegion<float>, BoxRegion<float>>;

  Collector(const Shape& shape, absl::Span<uint32_t> triangles)
      : shape_(shape), region_(shape), triangles_(triangles) {}

  Aabbf bounds() const { return region_.bounds(); }
  bool overlaps(const Aabbf& box) const { return region_.overlaps(box); }
  bool visit(const Triangle& triangle) {
    if (!meets(triangle)) return true;
    full_ = count_ == triangles_.size();
    if (!full_) triangles_[count_++] = triangle.number;
    return !full_;
  }
  size_t count() const { return count_; }
  bool full() const { return full_; }

 private:
  bool meets(const Triangle& triangle) const {
    if constexpr (std::is_same_v<Shape, Ballf>)
      return ball_overlaps(shape_, triangle);
    else
      return box_overlaps(shape_, triangle);
  }

  const Shape& shape_;
  const Region region_;
  const absl::Span<uint32_t> triangles_;
  size_t count_ = 0;
  bool full_ = false;
};

// State of one find_triangles() call. Answers the regions in order, up to kMaxRegions of them in one call of a kernel.
template <class Shape>
class BatchSearch {
 public:
  BatchSearch(const TriangleBvh& tree, absl::Span<const Shape> shapes, absl::Span<uint32_t> counts,
              absl::Span<uint32_t> triangles)
      : tree_(tree), shapes_(shapes), counts_(counts), triangles_(triangles) {
    LOCUS_CHECK_LE(shapes.size(), counts.size());
  }

  size_t run() {
    while (done_ < shapes_.size()) {
      const size_t count = next_for_one_kernel();
      if (!(count == 0 ? find_without_kernels(shapes_[done_]) : find_many(count))) break;
    }
    return done_;
  }

 private:
  // Returns how many of the next regions one kernel can answer in one call; 0 if no kernel supports the next region.
  size_t next_for_one_kernel() const {
    if (active_region_kernels() == nullptr) return 0;
    const bool first_rotated = rotated(shapes_[done_]);
    size_t count = 0;
    while (count < kMaxRegions && done_ + count < shapes_.size()) {
      const Shape& shape = shapes_[done_ + count];
      if (!TriangleSearch<Shape>::served(tree_, shape) || rotated(shape) != first_rotated) break;
      ++count;
    }
    return count;
  }
  static bool rotated(const Ballf& /*ball*/) { return false; }
  static bool rotated(const Obbf& box) { return !(box.rotation == Rotation{}); }

  bool find_many(size_t count) {
    decltype(kernel_region(shapes_[0])) regions[kMaxRegions];
    RegionPredicate predicates[kMaxRegions];
    for (size_t i = 0; i < count; ++i) {
      regions[i] = kernel_region(shapes_[done_ + i]);
      predicates[i] = predicate_of(shapes_[done_ + i]);
    }
    uint32_t* const counts = counts_.data() + done_;
    const size_t answered = kernel_for(shapes_[done_])
                                .many(tree_.tree(), regions, predicates, count, triangles_.data() + used_,
                                      triangles_.size() - used_, counts);
    for (size_t i = 0; i < answered; ++i) used_ += counts[i];
    done_ += answered;
    LOCUS_DCHECK_LE(answered, count);
    LOCUS_DCHECK_LE(used_, triangles_.size());
    return answered == count;
  }

  bool find_without_kernels(const Shape& shape) {
    Collector<Shape> collector(shape, triangles_.subspan(used_));
    Work work;
    tree_.visit_region(collector, work);
    if (collector.full()) return false;
    counts_[done_++] = static_cast<uint32_t>(collector.count());
    used_ += collector.count();
    return true;
  }

  const TriangleBvh& tree_;
  const absl::Span<const Shape> shapes_;
  const absl::Span<uint32_t> counts_, triangles_;
  size_t done_ = 0;  // regions answered
  size_t used_ = 0;  // entries of triangles_ written
};

}  // namespace

KernelBall kernel_region(const Ballf& ball) { return {{ball.center.x, ball.center.y, ball.center.z}, ball.radius}; }

KernelBox kernel_region(const Obbf& box) {
  KernelBox region;
  copy(box.center, region.center);
  copy(box.half, region.half);
  const Rotation& rotation = box.rotation;
  copy(to_float(rotation.row_x), region.rotation);
  copy(to_float(rotation.row_y), region.rotation + 3);
  copy(to_float(rotation.row_z), region.rotation + 6);
  const Aabbd bounds = bounds_of(box);
  for (int axis = 0; axis < 3; ++axis) {
    const auto low = static_cast<float>(bounds.min[axis]), high = static_cast<float>(bounds.max[axis]);
    region.outer_min[axis] = low - epsilon(low);
    region.outer_max[axis] = high + epsilon(high);
    region.inner_min[axis] = low + epsilon(low);
    region.inner_max[axis] = high - epsilon(high);
  }
  return region;
}

RegionPredicate predicate_of(const Ballf& ball) { return {ball_meets, &ball}; }
RegionPredicate predicate_of(const Obbf& box) { return {box_meets, &box}; }

size_t find_triangles(const TriangleBvh& tree, absl::Span<const Ballf> balls, absl::Span<uint32_t> counts,
                      absl::Span<uint32_t> triangles) {
  return BatchSearch<Ballf>(tree, balls, counts, triangles).run();
}

size_t find_triangles(const TriangleBvh& tree, absl::Span<const Obbf> boxes, absl::Span<uint32_t> counts,
                      absl::Span<uint32_t> triangles) {
  return BatchSearch<Obbf>(tree, boxes, counts, triangles).run();
}

}  // namespace locus
