#include "core/query/triangle_search.h"

#include <algorithm>
#include <memory>

#include "core/base/check.h"
#include "core/index/regions.h"

namespace locus {
namespace {

Triangle triangle_at(const TriangleBlock& block, uint32_t place) {
  const auto vertex = [&](int row) {
    return Vec3f{block.vertices[row][place], block.vertices[row + 1][place], block.vertices[row + 2][place]};
  };
  return {vertex(0), vertex(3), vertex(6), 0};
}

bool ball_meets(const void* ball, const TriangleBlock& block, uint32_t place) {
  return ball_overlaps(*static_cast<const Ballf*>(ball), triangle_at(block, place));
}

bool box_meets(const void* box, const TriangleBlock& block, uint32_t place) {
  return box_overlaps(*static_cast<const Obbf*>(box), triangle_at(block, place));
}

void copy(Vec3f from, float* to) {
  for (int axis = 0; axis < 3; ++axis) to[axis] = from[axis];
}

// More than rounding to float can have moved it by.
float pad(float value) { return std::abs(value) * 0x1p-22f + std::numeric_limits<float>::min(); }

// Collects numbers until there is no room left.
template <class Shape>
class Collector {
 public:
  using Region = std::conditional_t<std::is_same_v<Shape, Ballf>, BallRegion<float>, BoxRegion<float>>;

  Collector(const Shape& shape, absl::Span<uint32_t> numbers) : shape_(shape), region_(shape), numbers_(numbers) {}

  Aabbf bounds() const { return region_.bounds(); }
  bool overlaps(const Aabbf& box) const { return region_.overlaps(box); }
  bool visit(const Triangle& triangle) {
    if (!meets(triangle)) return true;
    full_ = count_ == numbers_.size();
    if (!full_) numbers_[count_++] = triangle.number;
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
  const absl::Span<uint32_t> numbers_;
  size_t count_ = 0;
  bool full_ = false;
};

// Answers regions one behind the other. Memory that a large tree's searches wait for is worth taking turns for.
template <class Shape>
class BatchSearch {
 public:
  BatchSearch(const TriangleBvh& tree, absl::Span<const Shape> shapes, absl::Span<uint32_t> counts,
              absl::Span<uint32_t> numbers)
      : tree_(tree), shapes_(shapes), counts_(counts), numbers_(numbers) {
    LOCUS_CHECK_LE(shapes.size(), counts.size());
  }

  size_t run() {
    const bool in_turns = tree_.bytes() >= kTurnsFromBytes && shapes_.size() > 1;
    if (in_turns) places_ = std::make_unique_for_overwrite<uint32_t[]>(kTurns * kPlace);
    while (done_ < shapes_.size()) {
      const size_t turns = in_turns ? std::min(kTurns, shapes_.size() - done_) : 1;
      const bool fits = turns > 1 && of_one_kernel(turns) ? find_in_turns(turns) : find(shapes_[done_]);
      if (!fits) break;
    }
    return done_;
  }

 private:
  static constexpr size_t kTurnsFromBytes = size_t{2} << 20;
  static constexpr size_t kTurns = 8;
  static constexpr size_t kPlace = 1024;  // numbers for each of those that take turns; what is more comes after

  bool of_one_kernel(size_t turns) const {
    for (const Shape& shape : shapes_.subspan(done_, turns))
      if (!TriangleSearch<Shape>::served(tree_, shape) || kernel_for(shape) != kernel_for(shapes_[done_])) return false;
    return true;
  }

  bool book(size_t count) {
    counts_[done_++] = static_cast<uint32_t>(count);
    used_ += count;
    return true;
  }

  bool find(const Shape& shape) {
    if (!TriangleSearch<Shape>::served(tree_, shape)) return find_without_kernels(shape);
    TriangleSearch<Shape> search(tree_, shape);
    size_t count = 0;
    while (!search.over()) {
      const size_t room = numbers_.size() - used_ - count;
      if (room < kMinRegionRoom) return false;
      count += search.next(numbers_.data() + used_ + count, room);
    }
    return book(count);
  }

  bool find_without_kernels(const Shape& shape) {
    Collector<Shape> collector(shape, numbers_.subspan(used_));
    Work work;
    tree_.visit_region(collector, work);
    return !collector.full() && book(collector.count());
  }

  bool find_in_turns(size_t turns) {
    decltype(kernel_region(shapes_[0])) regions[kTurns];
    RegionVisit visits[kTurns];
    const auto kernel = kernel_for(shapes_[done_]);
    for (size_t i = 0; i < turns; ++i) {
      regions[i] = kernel_region(shapes_[done_ + i]);
      visits[i].start(judge_of(shapes_[done_ + i]));
      visits[i].numbers = places_.get() + i * kPlace;
      visits[i].room = kPlace;
    }
    kernel(tree_.tree(), regions, visits, turns);
    for (size_t i = 0; i < turns; ++i) {
      size_t count = visits[i].found;
      if (count > numbers_.size() - used_) return false;
      std::copy_n(visits[i].numbers, count, numbers_.data() + used_);
      while (!visits[i].over()) {
        visits[i].numbers = numbers_.data() + used_ + count;
        visits[i].room = numbers_.size() - used_ - count;
        if (visits[i].room < kMinRegionRoom) return false;
        kernel(tree_.tree(), &regions[i], &visits[i], 1);
        count += visits[i].found;
      }
      book(count);
    }
    return true;
  }

  const TriangleBvh& tree_;
  const absl::Span<const Shape> shapes_;
  const absl::Span<uint32_t> counts_, numbers_;
  std::unique_ptr<uint32_t[]> places_;
  size_t done_ = 0, used_ = 0;
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
    region.outer_min[axis] = low - pad(low);
    region.outer_max[axis] = high + pad(high);
    region.inner_min[axis] = low + pad(low);
    region.inner_max[axis] = high - pad(high);
  }
  return region;
}

RegionJudge judge_of(const Ballf& ball) { return {ball_meets, &ball}; }
RegionJudge judge_of(const Obbf& box) { return {box_meets, &box}; }

size_t find_triangles(const TriangleBvh& tree, absl::Span<const Ballf> balls, absl::Span<uint32_t> counts,
                      absl::Span<uint32_t> numbers) {
  return BatchSearch<Ballf>(tree, balls, counts, numbers).run();
}

size_t find_triangles(const TriangleBvh& tree, absl::Span<const Obbf> boxes, absl::Span<uint32_t> counts,
                      absl::Span<uint32_t> numbers) {
  return BatchSearch<Obbf>(tree, boxes, counts, numbers).run();
}

}  // namespace locus
