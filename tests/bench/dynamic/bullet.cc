#include <BulletCollision/BroadphaseCollision/btDbvt.h>

#include "tests/bench/dynamic/id_map.h"
#include "tests/bench/dynamic/peers.h"
#include "tests/bench/dynamic/scalar_tests.h"

namespace locus::bench::dynamic {
namespace {

constexpr btScalar kMargin = 0.25f;
constexpr btScalar kTicksAhead = 2;  // a box is extended by the object's path of this many ticks

btVector3 vector_of(Vec3f v) { return {v.x, v.y, v.z}; }
btDbvtVolume volume_of(Vec3f center, float radius) { return btDbvtVolume::FromCR(vector_of(center), radius); }

// Visitor of the leaves whose boxes overlap the query's box. It calls `test`, which tests the object itself.
template <class Test>
class Leaves : public btDbvt::ICollide {
 public:
  explicit Leaves(const Test& test) : test_(test) {}
  void Process(const btDbvtNode* leaf) { test_(static_cast<uint32_t>(leaf->dataAsInt)); }

 private:
  const Test& test_;
};

class BulletTree : public Contender {
 public:
  BulletTree() : Contender("bullet") {}
  bool does(Task task) const override { return task != Task::kNearest; }

  void load(const Objects& objects) override {
    map_ = std::make_unique<IdMap>(objects.ids);
    bodies_ = bodies_of(objects);
    leaves_.resize(bodies_.size());
    for (uint32_t i = 0; i < bodies_.size(); ++i) insert_leaf(i);
    tree_.optimizeTopDown();
  }
  void move(const Moves& moves) override {
    for (size_t i = 0; i < moves.ids.size(); ++i) {
      const uint32_t number = map_->number_of(moves.ids[i]);
      bodies_[number].position = point_at(moves.positions, i);
      btDbvtVolume volume = volume_of(bodies_[number].position, bodies_[number].radius);
      tree_.update(leaves_[number], volume, vector_of(point_at(moves.velocities, i)) * kTicksAhead, kMargin);
    }
    tree_.optimizeIncremental(1 + static_cast<int>(moves.ids.size()) / 100);
  }
  void remove(absl::Span<const uint64_t> ids) override {
    for (const uint64_t id : ids) tree_.remove(leaves_[map_->remove(id)]);
  }
  void insert(const Objects& objects) override {
    for (size_t i = 0; i < objects.ids.size(); ++i) {
      const uint32_t number = map_->insert(objects.ids[i]);
      bodies_[number] = body_at(objects, i);
      insert_leaf(number);
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
  void insert_leaf(uint32_t number) {
    const Body& body = bodies_[number];
    leaves_[number] = tree_.insert(volume_of(body.position, body.radius), nullptr);
    leaves_[number]->dataAsInt = static_cast<int>(number);
  }
  template <class Meets>
  void collect(Vec3f center, std::vector<uint64_t>& ids, const Meets& meets) {
    const auto test = [&](uint32_t number) {
      const Body& body = bodies_[number];
      if (meets(body.position, body.radius, center)) ids.push_back(body.id);
    };
    Leaves<decltype(test)> leaves(test);
    tree_.collideTVNoStackAlloc(tree_.m_root, volume_of(center, kReach), stack_, leaves);
  }
  FirstHit first_of(const Rayf& ray) {
    FirstHit first;
    const auto test = [&](uint32_t number) {
      const Body& body = bodies_[number];
      scalar_ray_meets(ray, body.position, body.radius, body.id, first);
    };
    Leaves<decltype(test)> leaves(test);
    const btVector3 from = vector_of(ray.origin), direction = vector_of(ray.direction), none(0, 0, 0);
    btVector3 inverse;
    for (int axis = 0; axis < 3; ++axis)
      inverse[axis] = direction[axis] == 0 ? btScalar(BT_LARGE_FLOAT) : 1 / direction[axis];
    unsigned int signs[3] = {inverse[0] < 0, inverse[1] < 0, inverse[2] < 0};
    tree_.rayTestInternal(tree_.m_root, from, from + direction * kRayLength, inverse, signs, kRayLength, none, none,
                          stack_, leaves);
    return first;
  }

  std::unique_ptr<IdMap> map_;
  std::vector<Body> bodies_;
  std::vector<btDbvtNode*> leaves_;
  btDbvt tree_;
  btNodeStack stack_;
};

}  // namespace

std::unique_ptr<Contender> bullet() { return std::make_unique<BulletTree>(); }

}  // namespace locus::bench::dynamic
