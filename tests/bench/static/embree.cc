#include "tests/bench/static/embree.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include "tests/bench/static/scalar_overlap.h"

namespace locus::bench {
namespace {

std::atomic<int64_t> monitored_bytes{0};

RTCDevice device() {
  static const RTCDevice only = [] {
    const RTCDevice made = rtcNewDevice("threads=1");
    const auto count = [](void*, ssize_t bytes, bool) {
      monitored_bytes += bytes;
      return true;
    };
    rtcSetDeviceMemoryMonitorFunction(made, count, nullptr);
    return made;
  }();
  return only;
}

// An Embree scene, built by commit(), and the copies of the mesh's buffers that it uses. The vertices are padded, since
// Embree reads beyond the last one.
class Scene {
 public:
  Scene(const BenchMesh& mesh, RTCSceneFlags flags) : flags_(flags), vertices_(mesh.vertices), indices_(mesh.indices) {
    vertices_.resize(vertices_.size() + 4);
  }
  ~Scene() { release(); }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  void release() {
    if (scene_ != nullptr) rtcReleaseScene(scene_);
    scene_ = nullptr;
  }
  void commit() {
    const int64_t before = monitored_bytes;
    scene_ = rtcNewScene(device());
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_MEDIUM);
    rtcSetSceneFlags(scene_, flags_);
    const RTCGeometry geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertices_.data(), 0,
                               3 * sizeof(float), (vertices_.size() - 4) / 3);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, indices_.data(), 0,
                               3 * sizeof(uint32_t), indices_.size() / 3);
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_MEDIUM);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
    tree_bytes_ = monitored_bytes - before;
  }
  RTCScene get() const { return scene_; }
  uint64_t bytes() const {
    return static_cast<uint64_t>(tree_bytes_) + vertices_.size() * sizeof(float) + indices_.size() * sizeof(uint32_t);
  }

 private:
  RTCSceneFlags flags_;
  std::vector<float> vertices_;
  std::vector<uint32_t> indices_;
  RTCScene scene_ = nullptr;
  int64_t tree_bytes_ = 0;
};

std::shared_ptr<const Scene> committed(const BenchMesh& mesh, RTCSceneFlags flags) {
  auto scene = std::make_shared<Scene>(mesh, flags);
  scene->commit();
  return scene;
}

RTCIntersectContext context_of(RTCIntersectContextFlags flags) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = flags;
  return context;
}

void set(RTCRay& to, const RayQuery& ray) {
  to.org_x = ray.origin.x;
  to.org_y = ray.origin.y;
  to.org_z = ray.origin.z;
  to.dir_x = ray.direction.x;
  to.dir_y = ray.direction.y;
  to.dir_z = ray.direction.z;
  to.tnear = 0;
  to.tfar = ray.t_max;
  to.time = 0;
  to.mask = ~0u;
  to.flags = 0;
}

void set(RTCRayHit& to, const RayQuery& ray) {
  set(to.ray, ray);
  to.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  to.hit.primID = kNoTriangle;
}

constexpr char kLeaks[] = "Embree lets rays pass between triangles where its scene is not RTC_SCENE_FLAG_ROBUST";

// Peer that uses rtcIntersect1 and rtcOccluded1, one ray per call.
class SingleRays : public Peer {
 public:
  SingleRays(std::string name, std::shared_ptr<const Scene> scene, std::vector<Task> tasks, std::string fault)
      : Peer(std::move(name)), scene_(std::move(scene)), tasks_(std::move(tasks)), fault_(std::move(fault)) {}
  std::string known_fault(Task) const override { return fault_; }
  bool does(Task task) const override { return std::find(tasks_.begin(), tasks_.end(), task) != tasks_.end(); }
  void first(absl::Span<const RayQuery> rays, RayAnswer* answers) override {
    RTCIntersectContext context = context_of(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
    RTCRayHit asked;
    for (const RayQuery& ray : rays) {
      set(asked, ray);
      rtcIntersect1(scene_->get(), &context, &asked);
      *answers++ = {asked.ray.tfar, asked.hit.primID};
    }
  }
  void any(absl::Span<const RayQuery> rays, uint8_t* answers) override {
    RTCIntersectContext context = context_of(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
    RTCRay asked;
    for (const RayQuery& ray : rays) {
      set(asked, ray);
      rtcOccluded1(scene_->get(), &context, &asked);
      *answers++ = asked.tfar < 0 ? 1 : 0;
    }
  }

 private:
  std::shared_ptr<const Scene> scene_;
  std::vector<Task> tasks_;
  std::string fault_;
};

// Peer that uses rtcIntersect1M, a stream of up to kStream rays per call; CoherentRayStream sets Embree's flag for
// coherent rays.
class RayStream : public Peer {
 public:
  explicit RayStream(std::shared_ptr<const Scene> scene) : Peer("embree_intersect1m"), scene_(std::move(scene)) {}
  bool does(Task task) const override { return task == Task::kFirst; }
  std::string known_fault(Task) const override { return kLeaks; }
  void first(absl::Span<const RayQuery> rays, RayAnswer* answers) override {
    ask(rays, answers, RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  }

 protected:
  RayStream(std::string name, std::shared_ptr<const Scene> scene) : Peer(std::move(name)), scene_(std::move(scene)) {}
  void ask(absl::Span<const RayQuery> rays, RayAnswer* answers, RTCIntersectContextFlags flags) {
    RTCIntersectContext context = context_of(flags);
    for (size_t begin = 0; begin < rays.size(); begin += kStream) {
      const size_t count = std::min(kStream, rays.size() - begin);
      for (size_t i = 0; i < count; ++i) set(stream_[i], rays[begin + i]);
      rtcIntersect1M(scene_->get(), &context, stream_, static_cast<unsigned>(count), sizeof(RTCRayHit));
      for (size_t i = 0; i < count; ++i) answers[begin + i] = {stream_[i].ray.tfar, stream_[i].hit.primID};
    }
  }

 private:
  static constexpr size_t kStream = 1024;
  std::shared_ptr<const Scene> scene_;
  RTCRayHit stream_[kStream];
};

class CoherentRayStream : public RayStream {
 public:
  explicit CoherentRayStream(std::shared_ptr<const Scene> scene) : RayStream("embree_intersect1m", std::move(scene)) {}
  bool does(Task task) const override { return task == Task::kFirstOfCamera; }
  void first(absl::Span<const RayQuery> rays, RayAnswer* answers) override {
    ask(rays, answers, RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
  }
};

void intersect(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRayHit8* rays) {
  rtcIntersect8(valid, scene, context, rays);
}
void intersect(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRayHit16* rays) {
  rtcIntersect16(valid, scene, context, rays);
}

// Peer that uses rtcIntersect8 or rtcIntersect16: packets of kWidth coherent rays.
template <class Packet, size_t kWidth>
class RayPackets : public Peer {
 public:
  RayPackets(std::string name, std::shared_ptr<const Scene> scene) : Peer(std::move(name)), scene_(std::move(scene)) {}
  bool does(Task task) const override { return task == Task::kFirstOfCamera; }
  std::string known_fault(Task) const override { return kLeaks; }
  void first(absl::Span<const RayQuery> rays, RayAnswer* answers) override {
    RTCIntersectContext context = context_of(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
    for (size_t begin = 0; begin < rays.size(); begin += kWidth) {
      const size_t count = std::min(kWidth, rays.size() - begin);
      alignas(64) int valid[kWidth];
      Packet packet;
      for (size_t i = 0; i < kWidth; ++i) {
        valid[i] = i < count ? -1 : 0;
        set_lane(packet, i, rays[begin + std::min(i, count - 1)]);
      }
      intersect(valid, scene_->get(), &context, &packet);
      for (size_t i = 0; i < count; ++i) answers[begin + i] = {packet.ray.tfar[i], packet.hit.primID[i]};
    }
  }

 private:
  static void set_lane(Packet& packet, size_t lane, const RayQuery& ray) {
    packet.ray.org_x[lane] = ray.origin.x;
    packet.ray.org_y[lane] = ray.origin.y;
    packet.ray.org_z[lane] = ray.origin.z;
    packet.ray.dir_x[lane] = ray.direction.x;
    packet.ray.dir_y[lane] = ray.direction.y;
    packet.ray.dir_z[lane] = ray.direction.z;
    packet.ray.tnear[lane] = 0;
    packet.ray.tfar[lane] = ray.t_max;
    packet.ray.time[lane] = 0;
    packet.ray.mask[lane] = ~0u;
    packet.ray.flags[lane] = 0;
    packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    packet.hit.primID[lane] = kNoTriangle;
  }
  std::shared_ptr<const Scene> scene_;
};

// Peer that uses rtcOccluded1 with a filter. The filter stores each hit and rejects it, so that the search continues.
class AllHits : public Peer {
 public:
  explicit AllHits(std::shared_ptr<const Scene> scene) : Peer("embree_robust"), scene_(std::move(scene)) {}
  bool does(Task task) const override { return task == Task::kAll; }
  void ray_ids(absl::Span<const RayQuery> rays, absl::Span<uint32_t> ids, uint32_t* counts) override {
    Found found{context_of(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT), ids.data(), 0};
    found.context.filter = take_down;
    RTCRay asked;
    for (const RayQuery& ray : rays) {
      set(asked, ray);
      found.count = 0;
      rtcOccluded1(scene_->get(), &found.context, &asked);
      *counts++ = found.count;
    }
  }

 private:
  struct Found {
    RTCIntersectContext context;  // must be the first member: the filter gets a pointer to it
    uint32_t* ids;
    uint32_t count;
  };

  static void take_down(const RTCFilterFunctionNArguments* arguments) {
    auto& found = *reinterpret_cast<Found*>(arguments->context);
    found.ids[found.count++] = RTCHitN_primID(arguments->hit, arguments->N, 0);
    arguments->valid[0] = 0;
  }

  std::shared_ptr<const Scene> scene_;
};

// Peer that uses rtcPointQuery; a float test decides about each triangle that rtcPointQuery finds. A box is searched by
// the ball around it.
class PointQuery : public Peer {
 public:
  PointQuery(const BenchMesh& mesh, std::shared_ptr<const Scene> scene)
      : Peer("embree_point_query"), triangles_(mesh.triangles), scene_(std::move(scene)) {}
  bool does(Task task) const override { return task == Task::kBall || task == Task::kBox; }
  void ball_ids(absl::Span<const Ballf> balls, absl::Span<uint32_t> ids, uint32_t* counts) override {
    for (const Ballf& ball : balls) {
      const auto test = [&](const Triangle& triangle) {
        return scalar_squared_distance(ball.center, triangle) <= ball.radius * ball.radius;
      };
      *counts++ = ask(ball, ids.data(), test);
    }
  }
  void box_ids(absl::Span<const Obbf> boxes, absl::Span<uint32_t> ids, uint32_t* counts) override {
    constexpr float kAround = 1.00001f;
    for (const Obbf& box : boxes) {
      const auto test = [&](const Triangle& triangle) { return scalar_box_overlaps(box.center, box.half, triangle); };
      *counts++ = ask({box.center, std::sqrt(squared_length(box.half)) * kAround}, ids.data(), test);
    }
  }

 private:
  template <class Test>
  struct Found {
    const std::vector<Triangle>& triangles;
    const Test& test;
    uint32_t* ids;
    uint32_t count;
  };

  template <class Test>
  uint32_t ask(const Ballf& ball, uint32_t* ids, const Test& test) const {
    Found<Test> found{triangles_, test, ids, 0};
    RTCPointQuery query;
    query.x = ball.center.x;
    query.y = ball.center.y;
    query.z = ball.center.z;
    query.radius = ball.radius;
    query.time = 0;
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    const auto decide = [](RTCPointQueryFunctionArguments* arguments) {
      auto& into = *static_cast<Found<Test>*>(arguments->userPtr);
      if (into.test(into.triangles[arguments->primID])) into.ids[into.count++] = arguments->primID;
      return false;  // false: the query's radius has not changed
    };
    rtcPointQuery(scene_->get(), &query, &context, decide, &found);
    return found.count;
  }

  const std::vector<Triangle>& triangles_;
  std::shared_ptr<const Scene> scene_;
};

class EmbreeBuilder : public Builder {
 public:
  explicit EmbreeBuilder(const BenchMesh& mesh) : Builder("embree_medium"), scene_(mesh, RTC_SCENE_FLAG_NONE) {}
  void prepare() override { scene_.release(); }
  void build() override { scene_.commit(); }
  uint64_t bytes() override { return scene_.bytes(); }

 private:
  Scene scene_;
};

}  // namespace

void add_embree_peers(const BenchMesh& mesh, Needs needs, Peers& peers) {
  if (!needs.rays && !needs.regions) return;
  const auto usual = committed(mesh, RTC_SCENE_FLAG_NONE);
  if (needs.rays) {
    const auto robust = committed(mesh, RTC_SCENE_FLAG_ROBUST);
    const std::vector<Task> firsts = {Task::kFirst, Task::kFirstOfCamera};
    peers.push_back(std::make_unique<SingleRays>("embree_intersect1", usual, firsts, kLeaks));
    peers.push_back(std::make_unique<SingleRays>("embree_occluded1", usual, std::vector<Task>{Task::kAny}, kLeaks));
    peers.push_back(std::make_unique<SingleRays>(
        "embree_robust", robust, std::vector<Task>{Task::kFirst, Task::kFirstOfCamera, Task::kAny}, ""));
    peers.push_back(std::make_unique<RayStream>(usual));
    peers.push_back(std::make_unique<CoherentRayStream>(usual));
    peers.push_back(std::make_unique<RayPackets<RTCRayHit8, 8>>("embree_intersect8", usual));
    peers.push_back(std::make_unique<RayPackets<RTCRayHit16, 16>>("embree_intersect16", usual));
  }
  if (!needs.regions) return;
  peers.push_back(std::make_unique<PointQuery>(mesh, usual));
  const auto filtered = committed(mesh, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
  peers.push_back(std::make_unique<AllHits>(filtered));
}

std::unique_ptr<Builder> embree_builder(const BenchMesh& mesh) { return std::make_unique<EmbreeBuilder>(mesh); }

}  // namespace locus::bench
