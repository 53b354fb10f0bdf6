// The one interface behind which we and every peer stand: objects come, move and go by ids of the caller's choice, and
// the same queries are asked in the same columns. One thread a contender.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_CONTENDER_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_CONTENDER_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/types/span.h"
#include "core/geometry/ray.h"

namespace locus::bench::dynamic {

inline constexpr float kReach = 10;  // the radius of every ball, half the edge of every box
inline constexpr float kRayLength = 100;
inline constexpr uint32_t kNearest = 8;

// Balls of N objects: positions are 3N.
struct Objects {
  absl::Span<const uint64_t> ids;
  absl::Span<const float> positions;
  absl::Span<const float> radii;
};

// Where they are now, and how far they go each tick: for those who can use it.
struct Moves {
  absl::Span<const uint64_t> ids;
  absl::Span<const float> positions;
  absl::Span<const float> velocities;
};

inline Vec3f point_at(absl::Span<const float> numbers, size_t i) {
  return {numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
}

// What was found, query after query.
struct Answers {
  std::vector<uint64_t> ids;
  std::vector<float> distances;  // rays and the nearest: one an id
  std::vector<uint32_t> counts;  // ids a query

  void clear() {
    ids.clear();
    distances.clear();
    counts.clear();
  }
};

enum class Task : uint8_t { kMove, kReinsert, kBall, kBox, kRay };

class Contender {
 public:
  explicit Contender(std::string name) : name_(std::move(name)) {}
  virtual ~Contender() = default;
  Contender(const Contender&) = delete;
  Contender& operator=(const Contender&) = delete;

  const std::string& name() const { return name_; }
  virtual bool does(Task task) const = 0;

  // All objects, by the fastest way there is. Called once, first.
  virtual void load(const Objects& objects) = 0;
  virtual void move(const Moves& moves) = 0;
  virtual void remove(absl::Span<const uint64_t>) {}
  virtual void insert(const Objects&) {}
  // Gives back what is kept only for looking back.
  virtual void forget_past() {}

  // Appended: everything that shares a point with the ball or box of kReach around each centre, in any order; the first
  // object on each ray, if there is one, and its distance.
  virtual void balls(absl::Span<const Vec3f>, Answers&) {}
  virtual void boxes(absl::Span<const Vec3f>, Answers&) {}
  virtual void rays(absl::Span<const Rayf>, Answers&) {}

 private:
  const std::string name_;
};

// For N centres: `find(center, ids)` appends.
template <class Find>
void each_region(absl::Span<const Vec3f> centers, Answers& answers, Find find) {
  for (const Vec3f& center : centers) {
    const size_t before = answers.ids.size();
    find(center, answers.ids);
    answers.counts.push_back(static_cast<uint32_t>(answers.ids.size() - before));
  }
}

// An id and a distance.
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

// Makes contenders of one kind.
struct Maker {
  std::string name;
  bool one_size_only = false;
  std::function<std::unique_ptr<Contender>()> make;
};

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_CONTENDER_H_
