#include "client/cli/extras/tune/structures/family.h"

#include <malloc.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

#include "client/cli/extras/tune/structures/hash_grid_index.h"
#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "core/index/bsp_tree/bsp_tree.h"
#include "core/index/bvh/bvh.h"
#include "core/index/grid/grid.h"
#include "core/index/kd_tree/kd_tree.h"
#include "core/index/list/list_index.h"
#include "core/index/octree/octree.h"
#include "core/index/queries/index_queries.h"
#include "core/index/queries/nearest_values.h"
#include "core/index/sphere_tree/sphere_tree.h"

template <>
struct locus::PrimitiveTraits<locus::cli::PlacedShape> {
  using Scalar = double;
  using RayQuery = ObjectRay;
  using BallQuery = Balld;
  using BoxQuery = Obbd;

  static uint64_t id(const cli::PlacedShape& value) { return value.id; }
  static Aabbd bounds(const cli::PlacedShape& value) { return bounds_of(value.shape); }
  static Vec3d position(const cli::PlacedShape& value) { return value.shape.position; }
  static std::optional<double> ray(const cli::PlacedShape& value, const ObjectRay& ray) {
    const std::optional<ShapeHit> hit = ray_hit(ray, value.shape);
    return hit ? std::optional<double>(hit->t) : std::nullopt;
  }
  static bool ball(const cli::PlacedShape& value, const Balld& ball) { return ball_overlaps(ball, value.shape); }
  static bool box(const cli::PlacedShape& value, const Obbd& box) { return box_overlaps(box, value.shape); }
  static double distance(const cli::PlacedShape& value, const Vec3d& point) {
    return locus::distance(point, value.shape);
  }
};

namespace locus::cli {
namespace {

// Clock of the processor time of this thread, which other programs disturb less than the time of day.
struct ThreadClock {
  using rep = int64_t;
  using period = std::nano;
  using duration = std::chrono::nanoseconds;
  using time_point = std::chrono::time_point<ThreadClock>;
  static constexpr bool is_steady = true;

  static time_point now() {
    timespec time = {};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return time_point(std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec));
  }
};

// Queries between two readings of the clock, which takes about as long as a fast query.
constexpr size_t kQueriesBetweenReadings = 16;

constexpr const char* kKinds[] = {"rays", "balls", "boxes", "nearest"};

uint64_t heap_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

Vec3f rounded(const Vec3d& v) { return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)}; }

// The queries as the traits of V take them.
template <class V>
struct QueriesOf {
  explicit QueriesOf(const FamilyQueries& queries) : nearest(queries.nearest) {
    for (const Rayd& ray : queries.rays) {
      lengths.push_back(static_cast<typename PrimitiveTraits<V>::Scalar>(ray.t_max));
      if constexpr (std::is_same_v<V, Triangle>) {
        rays.emplace_back(ray.origin, ray.direction);
      } else {
        rays.emplace_back(ray);
      }
    }
    for (const Balld& ball : queries.balls) {
      if constexpr (std::is_same_v<V, Triangle>) {
        balls.push_back({rounded(ball.center), static_cast<float>(ball.radius)});
      } else {
        balls.push_back(ball);
      }
    }
    for (const Obbd& box : queries.boxes) {
      if constexpr (std::is_same_v<V, Triangle>) {
        boxes.push_back({rounded(box.center), rounded(box.half), box.rotation});
      } else {
        boxes.push_back(box);
      }
    }
  }

  size_t count(size_t kind) const {
    const size_t counts[] = {rays.size(), balls.size(), boxes.size(), nearest.size()};
    return counts[kind];
  }

  std::vector<typename PrimitiveTraits<V>::RayQuery> rays;
  std::vector<typename PrimitiveTraits<V>::Scalar> lengths;  // of the rays
  std::vector<typename PrimitiveTraits<V>::BallQuery> balls;
  std::vector<typename PrimitiveTraits<V>::BoxQuery> boxes;
  const std::vector<NearestPoint>& nearest;
};

template <class V>
class Contestant {
 public:
  Contestant() = default;
  virtual ~Contestant() = default;
  Contestant(const Contestant&) = delete;
  Contestant& operator=(const Contestant&) = delete;

  // Files the values.
  virtual void build(const std::vector<V>& values) = 0;
  // Answers the query `number` of kKinds[kind]. Returns the number of its results.
  virtual size_t answer(size_t kind, const QueriesOf<V>& queries, size_t number) = 0;
};

template <class V, class Index, class Make>
class ContestantOf final : public Contestant<V> {
 public:
  explicit ContestantOf(Make make) : make_(std::move(make)) {}

  void build(const std::vector<V>& values) override { index_.emplace(make_(values)); }

  size_t answer(size_t kind, const QueriesOf<V>& queries, size_t number) override {
    found_.clear();
    nearest_.clear();
    if (kind == 0) {
      V value;
      auto distance = queries.lengths[number];
      return first_ray(*index_, queries.rays[number], value, distance) ? 1 : 0;
    }
    if (kind == 1) ball_overlap(*index_, queries.balls[number], found_);
    if (kind == 2) box_overlap(*index_, queries.boxes[number], found_);
    if (kind < 3) return found_.size();
    const NearestPoint& point = queries.nearest[number];
    nearest_values(*index_, point.point, point.max_distance, point.k, nearest_);
    return nearest_.size();
  }

 private:
  const Make make_;
  std::optional<Index> index_;
  std::vector<V> found_;  // kept, so that its memory is not part of the times
  std::vector<ValueAt<V>> nearest_;
};

template <class V>
struct Named {
  StructureFigures figures;
  std::unique_ptr<Contestant<V>> contestant;
  std::map<std::string, std::vector<double>> nanoseconds;
};

template <class V, class Make>
Named<V> named(const char* name, Make make) {
  using Index = std::decay_t<decltype(make(std::declval<const std::vector<V>&>()))>;
  Named<V> one;
  one.figures.name = name;
  one.contestant = std::make_unique<ContestantOf<V, Index, Make>>(std::move(make));
  return one;
}

// Makes a tree whose build fails only if there are too many values.
template <class Tree, class V>
Tree built(const std::vector<V>& values) {
  absl::StatusOr<Tree> tree = Tree::build(values);
  LOCUS_CHECK(tree.ok());
  return *std::move(tree);
}

template <class V>
std::vector<Named<V>> family() {
  using Values = std::vector<V>;
  std::vector<Named<V>> all;
  all.push_back(named<V>("list", [](const Values& values) {
    ListIndex<V> list;
    for (const V& value : values) list.insert(value);
    return list;
  }));
  all.push_back(named<V>("bvh", [](const Values& values) { return built<Bvh<V>>(values); }));
  all.push_back(named<V>("hash_grid", [](const Values& values) { return HashGridIndex<V>(values); }));
  all.push_back(named<V>("grid", [](const Values& values) { return Grid<V>::build(values); }));
  all.push_back(named<V>("kd_tree", [](const Values& values) { return KdTree<V>::build(values); }));
  all.push_back(named<V>("octree", [](const Values& values) { return Octree<V>::build(values); }));
  all.push_back(named<V>("bsp_tree", [](const Values& values) { return BspTree<V>::build(values); }));
  all.push_back(named<V>("sphere_tree", [](const Values& values) { return built<SphereTree<V>>(values); }));
  return all;
}

// Asks queries of one kind, from the first on, for up to `milliseconds`. Returns nanoseconds a query.
template <class V>
double time_kind(Contestant<V>& contestant, size_t kind, const QueriesOf<V>& queries, double milliseconds) {
  const ThreadClock::time_point begin = ThreadClock::now();
  const auto limit = std::chrono::duration<double, std::milli>(milliseconds);
  size_t asked = 0;
  // The results are used, so that no query is optimised away.
  volatile size_t results = 0;
  do {
    results = results + contestant.answer(kind, queries, asked % queries.count(kind));
    ++asked;
  } while (asked < queries.count(kind) && (asked % kQueriesBetweenReadings != 0 || ThreadClock::now() - begin < limit));
  return std::chrono::duration<double, std::nano>(ThreadClock::now() - begin).count() / static_cast<double>(asked);
}

double middle(std::vector<double> values) {
  LOCUS_CHECK(!values.empty());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

template <class V>
absl::StatusOr<std::vector<StructureFigures>> time_values(const std::vector<V>& values, const FamilyQueries& given,
                                                          const FamilyOptions& options,
                                                          const FamilyProgress& progress) {
  LOCUS_CHECK(!values.empty());
  const QueriesOf<V> queries(given);
  std::vector<Named<V>> all = family<V>();
  const auto total = all.size() * static_cast<uint64_t>(options.rounds + 2);
  uint64_t done = 0;
  for (Named<V>& one : all) {
    RETURN_IF_ERROR(progress(done++, total));
    const uint64_t before = heap_bytes();
    const ThreadClock::time_point begin = ThreadClock::now();
    one.contestant->build(values);
    one.figures.build_ms = std::chrono::duration<double, std::milli>(ThreadClock::now() - begin).count();
    one.figures.bytes = heap_bytes() - std::min(before, heap_bytes());
  }
  for (int round = 0; round <= options.rounds; ++round) {  // the first is not counted
    for (Named<V>& one : all) {
      RETURN_IF_ERROR(progress(done++, total));
      for (size_t kind = 0; kind < std::size(kKinds); ++kind) {
        if (queries.count(kind) == 0) continue;
        const double time = time_kind(*one.contestant, kind, queries, options.milliseconds);
        if (round > 0) one.nanoseconds[kKinds[kind]].push_back(time);
      }
    }
  }
  std::vector<StructureFigures> figures;
  for (Named<V>& one : all) {
    for (auto& [kind, times] : one.nanoseconds) one.figures.nanoseconds[kind] = middle(std::move(times));
    figures.push_back(std::move(one.figures));
  }
  return figures;
}

}  // namespace

absl::StatusOr<std::vector<StructureFigures>> time_shapes(const std::vector<PlacedShape>& values,
                                                          const FamilyQueries& queries, const FamilyOptions& options,
                                                          const FamilyProgress& progress) {
  return time_values(values, queries, options, progress);
}

absl::StatusOr<std::vector<StructureFigures>> time_triangles(const std::vector<Triangle>& values,
                                                             const FamilyQueries& queries, const FamilyOptions& options,
                                                             const FamilyProgress& progress) {
  return time_values(values, queries, options, progress);
}

std::map<std::string, std::string> best_structures(absl::Span<const StructureFigures> figures) {
  std::map<std::string, std::string> best;
  std::map<std::string, double> times;
  for (const StructureFigures& one : figures) {
    for (const auto& [kind, time] : one.nanoseconds) {
      const auto known = times.find(kind);
      if (known != times.end() && known->second <= time) continue;
      times[kind] = time;
      best[kind] = one.name;
    }
  }
  return best;
}

}  // namespace locus::cli
