#include <array>

#include "tests/bench/dynamic/id_map.h"
#include "tests/bench/dynamic/peers.h"
#include "tests/bench/dynamic/scalar_tests.h"

// A simple grid without tuning: one hash map from cells to lists of ids, and one from ids to objects.
namespace locus::bench::dynamic {
namespace {

constexpr float kCell = 10;
constexpr float kRadius = 0.5f;  // radius of all objects; an object is stored in the cell of its centre and extends
                                 // beyond that cell by at most kRadius

int cell_of(float x) { return static_cast<int>(std::floor(x / kCell)); }
uint64_t key_of(int x, int y, int z) {
  const auto part = [](int cell) { return uint64_t{static_cast<uint32_t>(cell) & 0x1FFFFFu}; };
  return part(x) << 42 | part(y) << 21 | part(z);
}
uint64_t key_of(Vec3f p) { return key_of(cell_of(p.x), cell_of(p.y), cell_of(p.z)); }

class NaiveGrid : public Contender {
 public:
  NaiveGrid() : Contender("flat_hash_map") {}
  bool does(Task task) const override { return task != Task::kNearest; }

  void load(const Objects& objects) override {
    bodies_.reserve(objects.ids.size());
    insert(objects);
  }
  void move(const Moves& moves) override {
    for (size_t i = 0; i < moves.ids.size(); ++i) {
      Vec3f& position = bodies_.find(moves.ids[i])->second.position;
      const Vec3f next = point_at(moves.positions, i);
      const uint64_t before = key_of(position), after = key_of(next);
      position = next;
      if (before == after) continue;
      take_out(before, moves.ids[i]);
      cells_[after].push_back(moves.ids[i]);
    }
  }
  void remove(absl::Span<const uint64_t> ids) override {
    for (const uint64_t id : ids) {
      const auto body = bodies_.find(id);
      take_out(key_of(body->second.position), id);
      bodies_.erase(body);
    }
  }
  void insert(const Objects& objects) override {
    for (size_t i = 0; i < objects.ids.size(); ++i) {
      const Body body = body_at(objects, i);
      bodies_[body.id] = body;
      cells_[key_of(body.position)].push_back(body.id);
    }
  }
  void balls(absl::Span<const Vec3f> centers, Answers& answers) override {
    each_region(centers, answers,
                [&](Vec3f center, std::vector<uint64_t>& ids) { collect(center, ids, scalar_ball_meets); });
  }
  void boxes(absl::Span<const Vec3f> centers, Answers& answers) override {
    each_region(centers, answers,
                [&](Vec3f center, std::vector<uint64_t>& ids) { collect(center, ids, scalar_box_meets); });
  }
  void rays(absl::Span<const Rayf> rays, Answers& answers) override {
    each_ray(rays, answers, [&](const Rayf& ray) { return first_of(ray); });
  }

 private:
  void take_out(uint64_t key, uint64_t id) {
    const auto cell = cells_.find(key);
    std::vector<uint64_t>& ids = cell->second;
    *std::find(ids.begin(), ids.end(), id) = ids.back();
    ids.pop_back();
    if (ids.empty()) cells_.erase(cell);
  }
  // Visits every object stored in the cells that the box from `low` to `high` overlaps.
  template <class Visit>
  void visit(Vec3f low, Vec3f high, const Visit& visit) const {
    for (int x = cell_of(low.x); x <= cell_of(high.x); ++x)
      for (int y = cell_of(low.y); y <= cell_of(high.y); ++y)
        for (int z = cell_of(low.z); z <= cell_of(high.z); ++z) {
          const auto cell = cells_.find(key_of(x, y, z));
          if (cell == cells_.end()) continue;
          for (const uint64_t id : cell->second) visit(bodies_.find(id)->second);
        }
  }
  template <class Meets>
  void collect(Vec3f center, std::vector<uint64_t>& ids, const Meets& meets) const {
    constexpr float kGrown = kReach + kRadius;
    const Vec3f reach = {kGrown, kGrown, kGrown};
    visit(center - reach, center + reach, [&](const Body& body) {
      if (meets(body.position, body.radius, center)) ids.push_back(body.id);
    });
  }
  // Returns the first hit. Divides the ray into segments of a cell's length and tests the objects around each segment.
  FirstHit first_of(const Rayf& ray) const {
    FirstHit first;
    const Vec3f grown = {kRadius, kRadius, kRadius};
    for (float t = 0; t < kRayLength && t <= first.distance + kRadius; t += kCell) {
      const Vec3f from = ray.origin + ray.direction * t, to = from + ray.direction * kCell;
      visit(min(from, to) - grown, max(from, to) + grown,
            [&](const Body& body) { scalar_ray_meets(ray, body.position, body.radius, body.id, first); });
    }
    return first;
  }

  absl::flat_hash_map<uint64_t, std::vector<uint64_t>> cells_;
  absl::flat_hash_map<uint64_t, Body> bodies_;
};

}  // namespace

std::unique_ptr<Contender> naive_grid() { return std::make_unique<NaiveGrid>(); }

}  // namespace locus::bench::dynamic
