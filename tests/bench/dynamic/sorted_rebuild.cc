#ifdef __AVX2__
#include <immintrin.h>
#endif

#include <array>
#include <bit>

#include "tests/bench/dynamic/id_map.h"
#include "tests/bench/dynamic/peers.h"
#include "tests/bench/dynamic/scalar_tests.h"

// All objects in the order of a dense grid's cells, sorted anew each tick by counting: no versions, no move of its own,
// one size of cells. What a moving world costs at least.
namespace locus::bench::dynamic {
namespace {

constexpr size_t kLanes = 8;

class SortedRebuild : public Contender {
 public:
  SortedRebuild() : Contender("sorted_rebuild") {}
  bool does(Task task) const override { return task != Task::kReinsert; }

  void load(const Objects& objects) override {
    map_ = std::make_unique<IdMap>(objects.ids);
    const size_t count = objects.ids.size();
    ids_.assign(objects.ids.begin(), objects.ids.end());
    radii_.assign(objects.radii.begin(), objects.radii.end());
    largest_ = *std::max_element(radii_.begin(), radii_.end());
    positions_.resize(count);
    for (size_t i = 0; i < count; ++i) positions_[i] = point_at(objects.positions, i);
    cells_.resize(count);
    // Vectors of floats may be read past the last object.
    for (std::vector<float>* column : {&x_, &y_, &z_, &r_}) column->resize(count + kLanes);
    sorted_ids_.resize(count);
    build();
  }
  void move(const Moves& moves) override {
    for (size_t i = 0; i < moves.ids.size(); ++i)
      positions_[map_->number_of(moves.ids[i])] = point_at(moves.positions, i);
    build();
  }
  void balls(absl::Span<const Vec3f> centers, Answers& answers) override {
    each_region(centers, answers, [&](Vec3f center, std::vector<uint64_t>& ids) {
      each_run(center - reach(), center + reach(),
               [&](uint32_t begin, uint32_t end) { balls_of(center, begin, end, ids); });
    });
  }
  void boxes(absl::Span<const Vec3f> centers, Answers& answers) override {
    each_region(centers, answers, [&](Vec3f center, std::vector<uint64_t>& ids) {
      each_run(center - reach(), center + reach(), [&](uint32_t begin, uint32_t end) {
        for (uint32_t i = begin; i < end; ++i)
          if (scalar_box_meets({x_[i], y_[i], z_[i]}, r_[i], center)) ids.push_back(sorted_ids_[i]);
      });
    });
  }
  void rays(absl::Span<const Rayf> rays, Answers& answers) override {
    each_ray(rays, answers, [&](const Rayf& ray) { return first_of(ray); });
  }

 private:
  static Vec3f reach() { return {kReach, kReach, kReach}; }

  // Cells for four objects each on average, by the bounds of now.
  void lay_grid() {
    Vec3f high = positions_[0];
    low_ = high;
    for (const Vec3f& position : positions_) {
      low_ = min(low_, position);
      high = max(high, position);
    }
    constexpr float kLeast = 1e-3f;
    const Vec3f size = high - low_;
    const double volume = double{size.x + kLeast} * double{size.y + kLeast} * double{size.z + kLeast};
    cell_ = std::max(static_cast<float>(std::cbrt(4 * volume / static_cast<double>(positions_.size()))), kLeast);
    per_cell_ = 1 / cell_;
    for (int axis = 0; axis < 3; ++axis) last_[axis] = static_cast<int>(size[axis] * per_cell_);
    begins_.assign(
        static_cast<size_t>(last_[0] + 1) * static_cast<size_t>(last_[1] + 1) * static_cast<size_t>(last_[2] + 1) + 2,
        0);
  }
  void build() {
    lay_grid();
    for (size_t i = 0; i < positions_.size(); ++i) {
      const Vec3f p = positions_[i];
      cells_[i] = static_cast<uint32_t>(cell_at(cell_of(p, 0), cell_of(p, 1), cell_of(p, 2)));
      ++begins_[cells_[i] + 2];
    }
    for (size_t i = 2; i < begins_.size(); ++i) begins_[i] += begins_[i - 1];
    // The ends of runs grow until each is the next one's begin.
    for (uint32_t i = 0; i < positions_.size(); ++i) {
      const uint32_t at = begins_[cells_[i] + 1]++;
      x_[at] = positions_[i].x;
      y_[at] = positions_[i].y;
      z_[at] = positions_[i].z;
      r_[at] = radii_[i];
      sorted_ids_[at] = ids_[i];
    }
  }
  int cell_of(Vec3f p, int axis) const {
    return std::clamp(static_cast<int>(std::floor((p[axis] - low_[axis]) * per_cell_)), 0, last_[axis]);
  }
  size_t cell_at(int x, int y, int z) const {
    return (static_cast<size_t>(x) * static_cast<size_t>(last_[1] + 1) + static_cast<size_t>(y)) *
               static_cast<size_t>(last_[2] + 1) +
           static_cast<size_t>(z);
  }
  // The objects between `low` and `high`, and others, as runs of places.
  template <class Visit>
  void each_run(Vec3f low, Vec3f high, const Visit& visit) const {
    const Vec3f grown = {largest_, largest_, largest_};
    const Vec3f from = low - grown, to = high + grown;
    const int first_z = cell_of(from, 2), last_z = cell_of(to, 2);
    for (int x = cell_of(from, 0); x <= cell_of(to, 0); ++x)
      for (int y = cell_of(from, 1); y <= cell_of(to, 1); ++y) {
        const uint32_t begin = begins_[cell_at(x, y, first_z)], end = begins_[cell_at(x, y, last_z) + 1];
        if (begin < end) visit(begin, end);
      }
  }
#ifdef __AVX2__
  void balls_of(Vec3f center, uint32_t begin, uint32_t end, std::vector<uint64_t>& ids) const {
    const __m256 cx = _mm256_set1_ps(center.x), cy = _mm256_set1_ps(center.y), cz = _mm256_set1_ps(center.z);
    for (uint32_t i = begin; i < end; i += kLanes) {
      const __m256 dx = _mm256_sub_ps(_mm256_loadu_ps(&x_[i]), cx), dy = _mm256_sub_ps(_mm256_loadu_ps(&y_[i]), cy);
      const __m256 dz = _mm256_sub_ps(_mm256_loadu_ps(&z_[i]), cz);
      const __m256 sum = _mm256_add_ps(_mm256_set1_ps(kReach), _mm256_loadu_ps(&r_[i]));
      const __m256 squared =
          _mm256_add_ps(_mm256_mul_ps(dx, dx), _mm256_add_ps(_mm256_mul_ps(dy, dy), _mm256_mul_ps(dz, dz)));
      auto found =
          static_cast<uint32_t>(_mm256_movemask_ps(_mm256_cmp_ps(squared, _mm256_mul_ps(sum, sum), _CMP_LE_OQ)));
      if (end - i < kLanes) found &= (1u << (end - i)) - 1;
      for (; found != 0; found &= found - 1)
        ids.push_back(sorted_ids_[i + static_cast<uint32_t>(std::countr_zero(found))]);
    }
  }
#else
  void balls_of(Vec3f center, uint32_t begin, uint32_t end, std::vector<uint64_t>& ids) const {
    for (uint32_t i = begin; i < end; ++i)
      if (scalar_ball_meets({x_[i], y_[i], z_[i]}, r_[i], center)) ids.push_back(sorted_ids_[i]);
  }
#endif
  // By pieces of one cell's length.
  FirstHit first_of(const Rayf& ray) const {
    FirstHit first;
    for (float t = 0; t < kRayLength && t <= first.distance + largest_; t += cell_) {
      const Vec3f from = ray.origin + ray.direction * t, to = from + ray.direction * cell_;
      each_run(min(from, to), max(from, to), [&](uint32_t begin, uint32_t end) {
        for (uint32_t i = begin; i < end; ++i)
          scalar_ray_meets(ray, {x_[i], y_[i], z_[i]}, r_[i], sorted_ids_[i], first);
      });
    }
    return first;
  }

  std::unique_ptr<IdMap> map_;
  // By number.
  std::vector<uint64_t> ids_;
  std::vector<Vec3f> positions_;
  std::vector<float> radii_;
  std::vector<uint32_t> cells_;
  float largest_ = 0;  // of radii_
  // The grid: cell `c` is the places begins_[c] ... begins_[c + 1].
  Vec3f low_;
  float cell_ = 1, per_cell_ = 1;
  std::array<int, 3> last_{};
  std::vector<uint32_t> begins_;
  // By place.
  std::vector<float> x_, y_, z_, r_;
  std::vector<uint64_t> sorted_ids_;
};

}  // namespace

std::unique_ptr<Contender> sorted_rebuild() { return std::make_unique<SortedRebuild>(); }

}  // namespace locus::bench::dynamic
