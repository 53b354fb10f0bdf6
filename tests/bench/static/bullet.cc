#include "tests/bench/static/bullet.h"

#include <BulletCollision/NarrowPhaseCollision/btRaycastCallback.h>
#include <btBulletCollisionCommon.h>

#include "absl/strings/str_cat.h"
#include "tests/bench/static/scalar_overlap.h"

namespace locus::bench {
namespace {

btVector3 vector_of(Vec3f v) { return {v.x, v.y, v.z}; }

class NearestHit : public btTriangleRaycastCallback {
 public:
  NearestHit(const btVector3& from, const btVector3& to) : btTriangleRaycastCallback(from, to) {}
  btScalar reportHit(const btVector3&, btScalar fraction, int, int triangle) override {
    number = static_cast<uint32_t>(triangle);
    m_hitFraction = fraction;
    return fraction;
  }
  uint32_t number = kNoTriangle;
};

// Visitor of the triangles whose boxes overlap the query's box. It stores the numbers of triangles for which `test` is
// true.
template <class Test>
class Collect : public btTriangleCallback {
 public:
  Collect(const std::vector<Triangle>& triangles, const Test& test, uint32_t* ids)
      : triangles_(triangles), test_(test), ids_(ids) {}
  void processTriangle(btVector3*, int, int triangle) override {
    const auto number = static_cast<uint32_t>(triangle);
    if (test_(triangles_[number])) ids_[count++] = number;
  }
  uint32_t count = 0;

 private:
  const std::vector<Triangle>& triangles_;
  const Test& test_;
  uint32_t* ids_;
};

class Bullet : public Peer {
 public:
  explicit Bullet(const BenchMesh& mesh)
      : Peer("bullet"),
        mesh_(mesh),
        vertices_(mesh.vertices.begin(), mesh.vertices.end()),
        indices_(mesh.indices.begin(), mesh.indices.end()) {
    arrays_ = std::make_unique<btTriangleIndexVertexArray>(
        static_cast<int>(indices_.size() / 3), indices_.data(), static_cast<int>(3 * sizeof(int)),
        static_cast<int>(vertices_.size() / 3), vertices_.data(), static_cast<int>(3 * sizeof(btScalar)));
    shape_ = std::make_unique<btBvhTriangleMeshShape>(arrays_.get(), true, true);
  }
  bool does(Task task) const override { return task != Task::kAll; }
  bool slow() const override { return true; }
  std::string known_fault(Task task) const override {
    if (task == Task::kBall || task == Task::kBox) return "";
    return "Bullet tests triangles in float with a tolerance at their edges, and ends of rays by a part of their "
           "length";
  }

  void first(absl::Span<const RayQuery> rays, RayAnswer* answers) override {
    for (const RayQuery& ray : rays) *answers++ = first_of(ray);
  }
  void any(absl::Span<const RayQuery> rays, uint8_t* answers) override {
    for (const RayQuery& ray : rays) *answers++ = first_of(ray).triangle != kNoTriangle ? 1 : 0;
  }
  void ball_ids(absl::Span<const Ballf> balls, absl::Span<uint32_t> ids, uint32_t* counts) override {
    for (const Ballf& ball : balls) {
      const auto test = [&](const Triangle& triangle) {
        return scalar_squared_distance(ball.center, triangle) <= ball.radius * ball.radius;
      };
      const Vec3f reach = {ball.radius, ball.radius, ball.radius};
      *counts++ = collect({ball.center - reach, ball.center + reach}, ids.data(), test);
    }
  }
  void box_ids(absl::Span<const Obbf> boxes, absl::Span<uint32_t> ids, uint32_t* counts) override {
    for (const Obbf& box : boxes) {
      const auto test = [&](const Triangle& triangle) { return scalar_box_overlaps(box.center, box.half, triangle); };
      *counts++ = collect(ends_of(box), ids.data(), test);
    }
  }

 private:
  // Returns the first hit. Bullet's rays need an end. Twice the diagonal suffices, since no hit is further away from an
  // origin within the bounds or from the camera.
  RayAnswer first_of(const RayQuery& ray) {
    const float length = std::min(ray.t_max, 2 * mesh_.diagonal);
    const btVector3 from = vector_of(ray.origin), to = from + vector_of(ray.direction) * length;
    NearestHit hit(from, to);
    shape_->performRaycast(&hit, from, to);
    return {static_cast<float>(hit.m_hitFraction) * length, hit.number};
  }
  template <class Test>
  uint32_t collect(const Aabbf& bounds, uint32_t* ids, const Test& test) {
    Collect<Test> found(mesh_.triangles, test, ids);
    shape_->processAllTriangles(&found, vector_of(bounds.min), vector_of(bounds.max));
    return found.count;
  }

  const BenchMesh& mesh_;
  std::vector<btScalar> vertices_;
  std::vector<int> indices_;
  std::unique_ptr<btTriangleIndexVertexArray> arrays_;
  std::unique_ptr<btBvhTriangleMeshShape> shape_;
};

}  // namespace

void add_bullet_peer(const BenchMesh& mesh, Needs needs, Peers& peers, std::vector<std::string>& notes) {
  constexpr size_t kMaxTriangles = size_t{1} << (31 - MAX_NUM_PARTS_IN_BITS);
  if (!needs.rays && !needs.regions) return;
  if (mesh.triangles.size() < kMaxTriangles)
    peers.push_back(std::make_unique<Bullet>(mesh));
  else
    notes.push_back(
        absl::StrCat(mesh.name, ": bullet is left out: its trees hold fewer than ", kMaxTriangles, " triangles"));
}

}  // namespace locus::bench
