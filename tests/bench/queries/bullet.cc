#include <btBulletCollisionCommon.h>

#include "tests/bench/queries/sweep_cases.h"

namespace locus::bench::queries {
namespace {

btVector3 vector_of(const float* v) { return {v[0], v[1], v[2]}; }

// Bullet's own swept test: a btBvhTriangleMeshShape alone in a btCollisionWorld, queried by convexSweepTest().
class BulletSweeps : public SweepPeer {
 public:
  explicit BulletSweeps(const BenchMesh& mesh)
      : vertices_(mesh.vertices.begin(), mesh.vertices.end()),
        indices_(mesh.indices.begin(), mesh.indices.end()),
        arrays_(static_cast<int>(indices_.size() / 3), indices_.data(), static_cast<int>(3 * sizeof(int)),
                static_cast<int>(vertices_.size() / 3), vertices_.data(), static_cast<int>(3 * sizeof(btScalar))),
        shape_(&arrays_, true, true),
        dispatcher_(&configuration_),
        world_(&dispatcher_, &broadphase_, &configuration_) {
    object_.setCollisionShape(&shape_);
    world_.addCollisionObject(&object_);
  }
  ~BulletSweeps() override { world_.removeCollisionObject(&object_); }

  void sweep(const SweepWork& work, size_t begin, size_t end, SweepHit* hits) override {
    const std::unique_ptr<btConvexShape> solid = solid_of(work.solid);
    for (size_t i = begin; i < end; ++i) {
      btTransform from, to;
      from.setIdentity();
      to.setIdentity();
      from.setOrigin(vector_of(&work.starts[3 * i]));
      to.setOrigin(vector_of(&work.ends[3 * i]));
      btCollisionWorld::ClosestConvexResultCallback closest(from.getOrigin(), to.getOrigin());
      world_.convexSweepTest(solid.get(), from, to, closest);
      if (closest.hasHit()) hits[i].t = closest.m_closestHitFraction;
    }
  }

 private:
  static std::unique_ptr<btConvexShape> solid_of(const Mover& mover) {
    const auto radius = static_cast<float>(mover.radius);
    switch (mover.kind) {
      case MoverKind::kBall:
        return std::make_unique<btSphereShape>(radius);
      case MoverKind::kCapsule:
        return std::make_unique<btCapsuleShape>(radius, 2 * static_cast<float>(mover.half_axis.y));  // along y
      case MoverKind::kBox:
        return std::make_unique<btBoxShape>(btVector3(
            static_cast<float>(mover.half.x), static_cast<float>(mover.half.y), static_cast<float>(mover.half.z)));
    }
    return nullptr;
  }

  std::vector<btScalar> vertices_;
  std::vector<int> indices_;
  btTriangleIndexVertexArray arrays_;
  btBvhTriangleMeshShape shape_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btCollisionWorld world_;
  btCollisionObject object_;
};

}  // namespace

std::unique_ptr<SweepPeer> bullet_sweeps(const BenchMesh& mesh) { return std::make_unique<BulletSweeps>(mesh); }

}  // namespace locus::bench::queries
