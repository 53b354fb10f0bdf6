#include "tests/bench/dynamic/world.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "client/cli/levels/generate/splitmix64.h"

namespace locus::bench::dynamic {
namespace {

constexpr float kAround = 6.2831853f;
constexpr float kStep = 8;  // movement of an object per tick in a world of kind kBorder
constexpr uint32_t kTowns = 20;

class Draws {
 public:
  explicit Draws(uint64_t seed) : numbers_(seed) {}
  uint64_t next() { return numbers_.next(); }
  float unit() { return static_cast<float>(numbers_.next() >> 40) * 0x1p-24f; }
  Vec3f direction(float z_scale) {
    const float z = 2 * unit() - 1, angle = kAround * unit();
    const float radius = std::sqrt(std::max(0.0f, std::fma(-z, z, 1.0f)));
    const Vec3f d = {radius * std::cos(angle), radius * std::sin(angle), z * z_scale};
    const float length = std::sqrt(std::fma(d.z, d.z, std::fma(d.x, d.x, d.y * d.y)));
    return length < 1e-6f ? Vec3f{1, 0, 0} : Vec3f{d.x / length, d.y / length, d.z / length};
  }

 private:
  cli::SplitMix64 numbers_;
};

// Generator of the initial positions in a world of one kind.
class Places {
 public:
  Places(Kind kind, Vec3f low, Vec3f high) : draws_(1), kind_(kind), low_(low), size_(high - low) {
    for (Vec3f& town : towns_) {
      town.x = std::fma(1800.0f, draws_.unit(), 100.0f);
      town.y = std::fma(1800.0f, draws_.unit(), 100.0f);
    }
  }
  Vec3f next() {
    if (kind_ == Kind::kClustered && draws_.unit() < 0.8f) return in_town();
    if (hub_side(kind_) > 0 && starts_in_hub(drawn_++)) return in_hub();
    Vec3f place;
    for (int axis = 0; axis < 3; ++axis) place[axis] = std::fma(size_[axis], draws_.unit(), low_[axis]);
    if (kind_ == Kind::kBorder)
      for (int axis = 0; axis < 3; ++axis) place[axis] = std::floor(place[axis] / kStep) * kStep;
    return place;
  }

 private:
  Vec3f in_town() {
    const Vec3f town = towns_[draws_.next() % kTowns];
    const float angle = kAround * draws_.unit(), radius = 100 * std::sqrt(draws_.unit());
    return {std::fma(radius, std::cos(angle), town.x), std::fma(radius, std::sin(angle), town.y), 100 * draws_.unit()};
  }

  Vec3f in_hub() {
    const float side = hub_side(kind_);
    const Vec3f hub = {side, side, 20};
    Vec3f place;
    for (int axis = 0; axis < 3; ++axis)
      place[axis] = std::fma(hub[axis], draws_.unit() - 0.5f, low_[axis] + size_[axis] / 2);
    return place;
  }

  Draws draws_;
  Kind kind_;
  Vec3f low_, size_;
  size_t drawn_ = 0;  // number of positions drawn in a world with a hub
  std::array<Vec3f, kTowns> towns_;
};

void append(std::vector<float>& numbers, Vec3f v) { numbers.insert(numbers.end(), {v.x, v.y, v.z}); }

std::vector<float> drawn_velocities(Kind kind, uint32_t count) {
  std::vector<float> velocities;
  velocities.reserve(3 * size_t{count});
  Draws draws(2);
  for (uint32_t i = 0; i < count; ++i) {
    const Vec3f direction = draws.direction(1);
    Vec3f velocity = direction * (0.5f * draws.unit());
    if (kind == Kind::kBorder) {
      const auto axis = static_cast<int>(draws.next() % 3);
      velocity = {};
      velocity[axis] = (draws.next() & 1) != 0 ? kStep : -kStep;
    }
    append(velocities, velocity);
  }
  return velocities;
}

std::vector<float> drawn_radii(Kind kind, uint32_t count) {
  std::vector<float> radii(count, 0.5f);
  if (kind == Kind::kGiant) radii[0] = 5000;
  if (kind != Kind::kMixed) return radii;
  Draws draws(5);
  for (float& radius : radii) {
    const float a = 7 * draws.unit();
    radius = 0.25f * std::exp2(a * draws.unit());
  }
  return radii;
}

// Returns the position of a randomly drawn object, moved by up to 5 on each axis.
Vec3f near_an_object(const World& world, Draws& draws) {
  Vec3f point = point_at(world.objects().positions, draws.next() % world.count());
  for (int axis = 0; axis < 3; ++axis) point[axis] += std::fma(10.0f, draws.unit(), -5.0f);
  return point;
}

}  // namespace

const char* name_of(Kind kind) {
  constexpr std::array<const char*, kKinds.size()> kNames = {"uniform", "clustered", "far",   "onecell", "border",
                                                             "giant",   "mixed",     "hub20", "hub60",   "hub200"};
  return kNames[static_cast<size_t>(kind)];
}

std::string name_of_count(uint32_t count) {
  if (count % 1'000'000 == 0) return absl::StrCat(count / 1'000'000, "M");
  if (count % 1000 == 0) return absl::StrCat(count / 1000, "k");
  return absl::StrCat(count);
}

World::World(Kind kind, uint32_t count, float side)
    : kind_(kind),
      high_{side, side, 100},
      velocities_(drawn_velocities(kind, count)),
      radii_(drawn_radii(kind, count)) {
  if (kind == Kind::kFar) {
    low_ = {1e6f, 1e6f, 0};
    high_ = low_ + high_;
  }
  if (kind == Kind::kOneCell) {
    low_ = {1000, 1000, 48};
    high_ = {1008, 1008, 56};
  }
  cli::SplitMix64 numbers(7);
  Places places(kind, low_, high_);
  ids_.reserve(count);
  positions_.reserve(3 * size_t{count});
  for (uint32_t i = 0; i < count; ++i) {
    ids_.push_back(numbers.next() >> 1);
    append(positions_, places.next());
  }
}

std::string World::name() const { return absl::StrCat(name_of(kind_), "/", name_of_count(count())); }

void World::step() {
  for (uint32_t i = 0; i < count(); ++i) step(i);
}

void World::step(uint32_t object) {
  for (int axis = 0; axis < 3; ++axis) {
    const size_t at = 3 * size_t{object} + static_cast<size_t>(axis);
    float next = positions_[at] + velocities_[at];
    if (next < low_[axis] || next > high_[axis]) {
      velocities_[at] = -velocities_[at];
      next = std::clamp(positions_[at] + velocities_[at], low_[axis], high_[axis]);
    }
    positions_[at] = next;
  }
}

Queries queries_of(const World& world, size_t count) {
  Queries queries;
  Draws centers(3), rays(4);
  for (size_t i = 0; i < count; ++i) {
    queries.centers.push_back(near_an_object(world, centers));
    const Vec3f origin = near_an_object(world, rays);
    queries.rays.push_back({origin, rays.direction(0.2f), kRayLength});
  }
  return queries;
}

}  // namespace locus::bench::dynamic
