// The one interface of locus and of every peer: objects are inserted, moved and removed by ids that the caller chooses,
// and every contender gets the same queries in the same columns. Only one thread uses a contender.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_CONTENDER_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_CONTENDER_H_

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/types/span.h"
#include "core/geometry/ray.h"

namespace locus::bench::dynamic {

inline constexpr float kReach = 10;  // radius of every query ball, half the edge of every query box
inline constexpr float kRayLength = 100;
inline constexpr uint32_t kNearestCount = 8;

// Columns of N objects, which are balls: `positions` has x, y, z of each centre, 3N entries.
struct Objects {
  absl::Span<const uint64_t> ids;
  absl::Span<const float> positions;
  absl::Span<const float> radii;
};

// Columns of N moves: new positions, and velocities per tick for contenders that use them; 3N entries each.
struct Moves {
  absl::Span<const uint64_t> ids;
  absl::Span<const float> positions;
  absl::Span<const float> velocities;
};

inline Vec3f point_at(absl::Span<const float> numbers, size_t i) {
  return {numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
}

// Results of several queries, concatenated in the order of the queries.
struct Answers {
  std::vector<uint64_t> ids;
  std::vector<float> distances;  // one per id in results of rays and nearest; empty for other tasks
  std::vector<uint32_t> counts;  // number of ids of each query

  void clear() {
    ids.clear();
    distances.clear();
    counts.clear();
  }
};

enum class Task : uint8_t { kMove, kReinsert, kBall, kBox, kRay, kNearest };

class Contender {
 public:
  explicit Contender(std::string name) : name_(std::move(name)) {}
  virtual ~Contender() = default;
  Contender(const Contender&) = delete;
  Contender& operator=(const Contender&) = delete;

  const std::string& name() const { return name_; }
  virtual bool does(Task task) const = 0;

  // Loads all objects, by the contender's fastest method. Called once, before all other functions.
  virtual void load(const Objects& objects) = 0;
  virtual void move(const Moves& moves) = 0;
  virtual void remove(absl::Span<const uint64_t>) {}
  virtual void insert(const Objects&) {}
  // Releases past positions, which only queries about the past need.
  virtual void forget_past() {}

  // Appends the results of each query. Balls and boxes: every object that intersects the ball or box of kReach around
  // the centre, in any order. Rays: the first object that the ray hits, and its distance; no entry if the ray hits
  // none. Nearest: the kNearestCount objects nearest to the centre, the nearest first, with their distances; the
  // distance of an object that contains the centre is 0.
  virtual void balls(absl::Span<const Vec3f>, Answers&) {}
  virtual void boxes(absl::Span<const Vec3f>, Answers&) {}
  virtual void rays(absl::Span<const Rayf>, Answers&) {}
  virtual void nearest(absl::Span<const Vec3f>, Answers&) {}

 private:
  const std::string name_;
};

// Answers the query of each centre; `find(center, ids)` appends the ids of one query.
template <class Find>
void each_region(absl::Span<const Vec3f> centers, Answers& answers, Find find) {
  for (const Vec3f& center : centers) {
    const size_t before = answers.ids.size();
    find(center, answers.ids);
    answers.counts.push_back(static_cast<uint32_t>(answers.ids.size() - before));
  }
}

// First object that a ray hits, and its distance from the origin.
struct FirstHit {
  uint64_t id = 0;
  float distance = kRayLength;
  bool found = false;
};

template <class Find>
void each_ray(absl::Span<const Rayf> rays, Answers& answers, Find find) {
  for (const Rayf& ray : rays) {
    const FirstHit hit = find(ray);
    answers.counts.push_back(hit.found ? 1 : 0);
    if (!hit.found) continue;
    answers.ids.push_back(hit.id);
    answers.distances.push_back(hit.distance);
  }
}

// The kNearestCount candidates with the lowest keys, ascending. The key can be any number that grows with the distance.
class NearestFound {
 public:
  // Returns the bound of keys: a candidate is kept only if its key is lower.
  float limit() const {
    return count_ < kNearestCount ? std::numeric_limits<float>::infinity() : figures_[kNearestCount - 1];
  }
  void offer(float figure, uint64_t id) {
    if (figure >= limit()) return;
    size_t at = count_ < kNearestCount ? count_++ : kNearestCount - 1;
    for (; at > 0 && figures_[at - 1] > figure; --at) {
      figures_[at] = figures_[at - 1];
      ids_[at] = ids_[at - 1];
    }
    figures_[at] = figure;
    ids_[at] = id;
  }
  // Appends the candidates to `answers` as one query's result; `to_distance` converts each key to a distance.
  template <class ToDistance>
  void append_to(Answers& answers, const ToDistance& to_distance) const {
    answers.counts.push_back(static_cast<uint32_t>(count_));
    answers.ids.insert(answers.ids.end(), ids_.begin(), ids_.begin() + count_);
    for (size_t i = 0; i < count_; ++i) answers.distances.push_back(to_distance(figures_[i]));
  }

 private:
  std::array<float, kNearestCount> figures_{};
  std::array<uint64_t, kNearestCount> ids_{};
  size_t count_ = 0;
};

// Returns the distance of a point to a ball, 0 inside it. `squared` is the squared distance of the point to the ball's
// centre.
inline float surface_distance(float squared, float radius) { return std::max(0.0f, std::sqrt(squared) - radius); }

// Factory of one kind of contender.
struct Maker {
  std::string name;
  bool one_size_only = false;
  std::function<std::unique_ptr<Contender>()> make;
};

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_CONTENDER_H_
