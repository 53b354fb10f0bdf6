// GCC does not see that Bullet's Classify() initializes its vectors.
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"

#include <BulletCollision/BroadphaseCollision/btDbvt.h>

#include <algorithm>

#include "tests/bench/queries/object_cases.h"

namespace locus::bench::queries {
namespace {

// Two trees of Bullet. The first stores the balls' bounding boxes and answers frustums. The second stores these boxes
// grown by half of kPairDistance and answers pairs: the grown boxes of two balls within kPairDistance overlap.
class BulletObjects : public ObjectPeer {
 public:
  explicit BulletObjects(const dynamic::Objects& objects) {
    for (size_t i = 0; i < objects.ids.size(); ++i)
      balls_.push_back({dynamic::point_at(objects.positions, i), objects.radii[i], objects.ids[i]});
    fill(tight_, 0);
    fill(grown_, kPairDistance / 2);
  }

  void pairs(std::vector<ObjectPair>& pairs) override {
    struct Visitor : btDbvt::ICollide {
      Visitor(const std::vector<Ball>& all, std::vector<ObjectPair>& rows) : balls(all), found(rows) {}
      void Process(const btDbvtNode* first, const btDbvtNode* second) {
        const Ball &a = balls[static_cast<size_t>(first->dataAsInt)],
                   &b = balls[static_cast<size_t>(second->dataAsInt)];
        const Vec3f offset = a.center - b.center;
        const float reach = kPairDistance + a.radius + b.radius;
        if (dot(offset, offset) <= reach * reach) found.push_back({std::min(a.id, b.id), std::max(a.id, b.id)});
      }
      const std::vector<Ball>& balls;
      std::vector<ObjectPair>& found;
    } visitor(balls_, pairs);
    grown_.collideTT(grown_.m_root, grown_.m_root, visitor);
  }

  void frustum(const float* planes, std::vector<uint64_t>& ids) override {
    struct Visitor : btDbvt::ICollide {
      Visitor(const std::vector<Ball>& all, const float* of_region, std::vector<uint64_t>& rows)
          : balls(all), planes(of_region), found(rows) {}
      void Process(const btDbvtNode* leaf) {
        const Ball& ball = balls[static_cast<size_t>(leaf->dataAsInt)];
        for (size_t p = 0; p < kFrustumPlanes; ++p) {
          const float* const plane = planes + 4 * p;
          if (plane[0] * ball.center.x + plane[1] * ball.center.y + plane[2] * ball.center.z + plane[3] < -ball.radius)
            return;
        }
        found.push_back(ball.id);
      }
      const std::vector<Ball>& balls;
      const float* planes;
      std::vector<uint64_t>& found;
    } visitor(balls_, planes, ids);
    btVector3 normals[kFrustumPlanes];
    btScalar offsets[kFrustumPlanes];
    for (size_t p = 0; p < kFrustumPlanes; ++p) {
      normals[p] = {planes[4 * p], planes[4 * p + 1], planes[4 * p + 2]};
      offsets[p] = planes[4 * p + 3];
    }
    btDbvt::collideKDOP(tight_.m_root, normals, offsets, static_cast<int>(kFrustumPlanes), visitor);
  }

 private:
  struct Ball {
    Vec3f center;
    float radius;
    uint64_t id;
  };

  void fill(btDbvt& tree, float growth) {
    for (size_t i = 0; i < balls_.size(); ++i) {
      const Ball& ball = balls_[i];
      const btVector3 center(ball.center.x, ball.center.y, ball.center.z);
      tree.insert(btDbvtVolume::FromCR(center, ball.radius + growth), nullptr)->dataAsInt = static_cast<int>(i);
    }
    tree.optimizeTopDown();
  }

  std::vector<Ball> balls_;
  btDbvt tight_, grown_;
};

}  // namespace

std::unique_ptr<ObjectPeer> bullet_objects(const dynamic::Objects& objects) {
  return std::make_unique<BulletObjects>(objects);
}

}  // namespace locus::bench::queries
