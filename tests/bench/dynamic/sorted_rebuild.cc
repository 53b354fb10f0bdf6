#ifdef __AVX2__
#include <immintrin.h>
#endif

#include <array>
#include <bit>

#include "tests/bench/dynamic/id_map.h"
#include "tests/bench/dynamic/peers.h"
#include "tests/bench/dynamic/scalar_tests.h"

// A list of all objects in the order of a dense grid's cells, sorted anew at each tick by a counting sort. It keeps no
// versions, cannot move single objects and has one cell size, so its cost is a lower bound of the cost of a moving
// world.
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
    const auto [smallest, largest] = std::minmax_element(radii_.begin(), radii_.end());
    smallest_ = *smallest;
    largest_ = *largest;
    positions_.resize(count);
    for (size_t i = 0; i < count; ++i) positions_[i] = point_at(objects.positions, i);
    cells_.resize(count);
    // The AVX2 loop reads kLanes floats in one load, so it may read past the last object.
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
  void nearest(absl::Span<const Vec3f> centers, Answers& answers) override {
    for (const Vec3f& center : centers) {
      if (smallest_ == largest_)
        nearest_of<true>(center).append_to(answers,
                                           [this](float squared) { return surface_distance(squared, largest_); });
      else
        nearest_of<false>(center).append_to(answers, [](float distance) { return std::max(0.0f, distance); });
    }
  }

 private:
  static Vec3f reach() { return {kReach, kReach, kReach}; }

  // Chooses the cell size from the present bounds, so that a cell has four objects on average.
  void lay_grid() {
    Vec3f high = positions_[0];
    low_ = high;
    for (const Vec3f& position : positions_) {
      low_ = min(low_, position);
      high = max(high, position);
    }
    constexpr float kMin = 1e-3f;
    const Vec3f size = high - low_;
    const double volume = double{size.x + kMin} * double{size.y + kMin} * double{size.z + kMin};
    cell_ = std::max(static_cast<float>(std::cbrt(4 * volume / static_cast<double>(positions_.size()))), kMin);
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
    // begins_[c + 1] is the next free slot of cell `c`; at the end it is the begin of cell c + 1.
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
  // Calls visit(begin, end) for ranges of slots that contain all objects between `low` and `high`, and possibly other
  // objects.
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
  // Returns the first hit. Divides the ray into segments of a cell's length and tests the objects around each segment.
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

  // Searches rings of cells around the cell of `center` for the nearest objects. Objects are ordered by the distance
  // from `center` to their surface, negative inside. If all radii are equal (kOneSize), the squared distance to their
  // centres is used instead, which gives the same order.
  template <bool kOneSize>
  NearestFound nearest_of(Vec3f center) const {
    NearestFound found;
    const std::array<int, 3> home = {cell_of(center, 0), cell_of(center, 1), cell_of(center, 2)};
    float inside = std::numeric_limits<float>::infinity();  // distance of `center` to the nearest side of its cell
    for (int axis = 0; axis < 3; ++axis) {
      const float from_low = center[axis] - low_[axis] - static_cast<float>(home[static_cast<size_t>(axis)]) * cell_;
      inside = std::min({inside, from_low, cell_ - from_low});
    }
    const int last = *std::max_element(last_.begin(), last_.end());
    for (int ring = 0; ring <= last; ++ring) {
      const float away = static_cast<float>(ring - 1) * cell_ + std::max(0.0f, inside);
      if (ring > 0 && found.limit() <= (kOneSize ? away * away : away - largest_)) break;
      each_run_of_ring(home, ring, [&](uint32_t begin, uint32_t end) {
        for (uint32_t i = begin; i < end; ++i) {
          const float squared = squared_length(Vec3f{x_[i], y_[i], z_[i]} - center);
          found.offer(kOneSize ? squared : std::sqrt(squared) - r_[i], sorted_ids_[i]);
        }
      });
    }
    return found;
  }
  // Visits the cells at distance `ring` from `home`. The distance is measured in cells, as the maximum over the axes.
  template <class Visit>
  void each_run_of_ring(const std::array<int, 3>& home, int ring, const Visit& visit) const {
    const auto row = [&](int x, int y, int first_z, int last_z) {
      first_z = std::max(first_z, 0);
      last_z = std::min(last_z, last_[2]);
      if (first_z <= last_z) visit(begins_[cell_at(x, y, first_z)], begins_[cell_at(x, y, last_z) + 1]);
    };
    for (int x = std::max(home[0] - ring, 0); x <= std::min(home[0] + ring, last_[0]); ++x) {
      for (int y = std::max(home[1] - ring, 0); y <= std::min(home[1] + ring, last_[1]); ++y) {
        if (std::max(std::abs(x - home[0]), std::abs(y - home[1])) == ring) {
          row(x, y, home[2] - ring, home[2] + ring);
        } else {
          row(x, y, home[2] - ring, home[2] - ring);
          row(x, y, home[2] + ring, home[2] + ring);
        }
      }
    }
  }

  std::unique_ptr<IdMap> map_;
  // Columns indexed by object.
  std::vector<uint64_t> ids_;
  std::vector<Vec3f> positions_;
  std::vector<float> radii_;
  std::vector<uint32_t> cells_;
  float smallest_ = 0, largest_ = 0;  // minimum and maximum of radii_
  // The grid: cell `c` has the slots begins_[c] to begins_[c + 1] - 1.
  Vec3f low_;
  float cell_ = 1, per_cell_ = 1;
  std::array<int, 3> last_{};
  std::vector<uint32_t> begins_;
  // Columns indexed by slot: objects in the order of their cells.
  std::vector<float> x_, y_, z_, r_;
  std::vector<uint64_t> sorted_ids_;
};

}  // namespace

std::unique_ptr<Contender> sorted_rebuild() { return std::make_unique<SortedRebuild>(); }

}  // namespace locus::bench::dynamic
