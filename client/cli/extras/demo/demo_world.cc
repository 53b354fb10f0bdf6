#include "client/cli/extras/demo/demo_world.h"

#include <algorithm>
#include <cmath>

#include "client/cli/extras/demo/demo_random.h"
#include "core/geometry/rotation.h"

namespace locus::cli {
namespace {

constexpr float kInset = 0.98f;  // share of the level's size in which objects move, so that they stay inside its walls

locus::Quaternion random_rotation(DemoRandom& random) {
  for (;;) {
    const locus::Quaternion q{random.sign(), random.sign(), random.sign(), random.sign()};
    if (unit_deviation(q) < 0.5) return normalized(q);
  }
}

// Returns the position at `tick` of a point that moves between -half and half and reverses at both ends. The position
// is computed directly from the tick, so that rounding errors do not accumulate from tick to tick.
float bounce(float start, float velocity, uint64_t tick, float half) {
  if (half <= 0) return 0;
  const double period = 4.0 * half;
  double phase = std::fmod(double{start} + half + double{velocity} * static_cast<double>(tick), period);
  if (phase < 0) phase += period;
  const double distance = phase <= 2.0 * half ? phase : period - phase;
  return static_cast<float>(distance - half);
}

}  // namespace

DemoWorld::DemoWorld(const Aabbd& bounds, uint32_t objects, uint64_t seed)
    : bounds_(bounds), frame_((bounds.min + bounds.max) * 0.5), half_(to_float(bounds.extent() * (0.5 * kInset))) {
  DemoRandom random(seed);
  const float length = max_component(half_);
  objects_.reserve(objects);
  for (uint32_t i = 0; i < objects; ++i) {
    DemoObject object;
    object.kind = i % 4 == 2 ? ShapeKind::kBox : i % 4 == 3 ? ShapeKind::kCapsule : ShapeKind::kBall;
    const Vec3f at = random.cube();
    object.start = {at.x * half_.x, at.y * half_.y, at.z * half_.z};
    object.velocity = random.direction() * (length * 0.002f);
    object.radius = length * (0.001f + 0.004f * random.unit());
    object.size = {object.radius * (0.5f + random.unit()), object.radius * (0.5f + random.unit()), object.radius};
    object.rotation = object.kind == ShapeKind::kBall ? locus::Quaternion{} : random_rotation(random);
    objects_.push_back(object);
  }
}

Vec3f DemoWorld::offset(const DemoObject& object, uint64_t tick) const {
  return {bounce(object.start.x, object.velocity.x, tick, half_.x),
          bounce(object.start.y, object.velocity.y, tick, half_.y),
          bounce(object.start.z, object.velocity.z, tick, half_.z)};
}

Shape DemoWorld::shape(uint32_t index, uint64_t tick) const {
  const DemoObject& object = objects_[index];
  Shape shape;
  shape.kind = object.kind;
  shape.position = frame_ + to_double(offset(object, tick));
  shape.rotation = normalized(object.rotation);
  if (object.kind != ShapeKind::kBall) shape.size = object.size;
  if (object.kind != ShapeKind::kBox) shape.radius = object.radius;
  return shape;
}

v1::UpdateBatch DemoWorld::inserts() const {
  client::UpdateBuilder builder;
  builder.frame({frame_.x, frame_.y, frame_.z}).clear().tick(0).restart_ticks();
  for (uint32_t i = 0; i < size(); ++i) {
    const DemoObject& object = objects_[i];
    const Vec3f at = offset(object, 0);
    const client::Float3 position{at.x, at.y, at.z};
    const client::Float3 size{object.size.x, object.size.y, object.size.z};
    const client::Rotation rotation{object.rotation.x, object.rotation.y, object.rotation.z, object.rotation.w};
    if (object.kind == ShapeKind::kBall) builder.insert_ball(id(i), position, object.radius);
    if (object.kind == ShapeKind::kBox) builder.insert_box(id(i), position, size, rotation);
    if (object.kind == ShapeKind::kCapsule) builder.insert_capsule(id(i), position, size, object.radius, rotation);
  }
  return builder.build();
}

v1::UpdateBatch DemoWorld::moves(uint64_t tick) const {
  std::vector<uint64_t> ids(size());
  std::vector<float> positions;
  positions.reserve(size_t{3} * size());
  for (uint32_t i = 0; i < size(); ++i) {
    ids[i] = id(i);
    const Vec3f at = offset(objects_[i], tick);
    positions.insert(positions.end(), {at.x, at.y, at.z});
  }
  client::UpdateBuilder builder;
  builder.frame({frame_.x, frame_.y, frame_.z}).tick(tick);
  builder.moves({.ids = ids, .positions = positions});
  return builder.build();
}

}  // namespace locus::cli
