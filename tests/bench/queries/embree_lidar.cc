#include <embree3/rtcore.h>

#include <algorithm>
#include <limits>

#include "tests/bench/queries/lidar_cases.h"

namespace locus::bench::queries {
namespace {

// Scene of the level and the instances of a box.
class LidarScene {
 public:
  LidarScene(const BenchMesh& mesh, const std::vector<LidarBox>& boxes)
      : vertices_(mesh.vertices), indices_(mesh.indices), device_(rtcNewDevice("threads=1")) {
    scene_ = rtcNewScene(device_);
    vertices_.resize(vertices_.size() + 4);  // Embree reads beyond the last vertex
    attach(scene_, triangles(vertices_, indices_));
    box_ = rtcNewScene(device_);
    attach(box_, triangles(box_vertices_, box_indices_));
    rtcCommitScene(box_);
    for (const LidarBox& box : boxes) {
      const RTCGeometry instance = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_INSTANCE);
      rtcSetGeometryInstancedScene(instance, box_);
      const float transform[12] = {box.half.x,   0,           0, 0, box.half.y, 0, 0, 0, box.half.z, box.center.x,
                                   box.center.y, box.center.z};
      rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, transform);
      attach(scene_, instance);
    }
    rtcCommitScene(scene_);
  }
  ~LidarScene() {
    rtcReleaseScene(scene_);
    rtcReleaseScene(box_);
    rtcReleaseDevice(device_);
  }
  LidarScene(const LidarScene&) = delete;
  LidarScene& operator=(const LidarScene&) = delete;

  RTCScene get() const { return scene_; }

 private:
  RTCGeometry triangles(const std::vector<float>& vertices, const std::vector<uint32_t>& indices) {
    const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertices.data(), 0,
                               3 * sizeof(float), (vertices.size() - 4) / 3);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, indices.data(), 0,
                               3 * sizeof(uint32_t), indices.size() / 3);
    return geometry;
  }
  static void attach(RTCScene scene, RTCGeometry geometry) {
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
  }

  std::vector<float> vertices_;
  std::vector<uint32_t> indices_;
  // The box from -1 to 1. Bit k of the number of a vertex gives its side along axis k.
  std::vector<float> box_vertices_ = {-1, -1, -1, 1, -1, -1, -1, 1, -1, 1, 1, -1, -1, -1,
                                      1,  1,  -1, 1, -1, 1,  1,  1, 1,  1, 0, 0,  0,  0};
  std::vector<uint32_t> box_indices_ = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                        2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  RTCDevice device_;
  RTCScene scene_, box_;
};

RTCIntersectContext coherent() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

constexpr float kInfinity = std::numeric_limits<float>::infinity();

LidarHit hit_of(float t, unsigned geometry, unsigned instance) {
  return {geometry == RTC_INVALID_GEOMETRY_ID ? kInfinity : t, instance != RTC_INVALID_GEOMETRY_ID};
}

void set(RTCRayHit& to, const RayQuery& ray) {
  to.ray = {ray.origin.x,
            ray.origin.y,
            ray.origin.z,
            0,
            ray.direction.x,
            ray.direction.y,
            ray.direction.z,
            0,
            ray.t_max,
            ~0u,
            0,
            0};
  to.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  to.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
}

// Traces the rays by rtcIntersect1M, in streams of kStream rays, or by rtcIntersect1 if kStream is 1.
template <size_t kStream>
class Stream : public LidarPeer {
 public:
  explicit Stream(std::shared_ptr<const LidarScene> scene) : scene_(std::move(scene)) {}
  const char* name() const override { return kStream == 1 ? "embree_intersect1" : "embree_intersect1m"; }
  void first(absl::Span<const RayQuery> rays, LidarHit* hits) override {
    RTCIntersectContext context = coherent();
    for (size_t begin = 0; begin < rays.size(); begin += kStream) {
      const size_t count = std::min(kStream, rays.size() - begin);
      for (size_t i = 0; i < count; ++i) set(stream_[i], rays[begin + i]);
      if (kStream == 1)
        rtcIntersect1(scene_->get(), &context, stream_);
      else
        rtcIntersect1M(scene_->get(), &context, stream_, static_cast<unsigned>(count), sizeof(RTCRayHit));
      for (size_t i = 0; i < count; ++i)
        *hits++ = hit_of(stream_[i].ray.tfar, stream_[i].hit.geomID, stream_[i].hit.instID[0]);
    }
  }

 private:
  std::shared_ptr<const LidarScene> scene_;
  RTCRayHit stream_[kStream];
};

void intersect(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRayHit8* rays) {
  rtcIntersect8(valid, scene, context, rays);
}
void intersect(const int* valid, RTCScene scene, RTCIntersectContext* context, RTCRayHit16* rays) {
  rtcIntersect16(valid, scene, context, rays);
}

template <class Packet, size_t kWidth>
class Packets : public LidarPeer {
 public:
  explicit Packets(std::shared_ptr<const LidarScene> scene) : scene_(std::move(scene)) {}
  const char* name() const override { return kWidth == 8 ? "embree_intersect8" : "embree_intersect16"; }
  void first(absl::Span<const RayQuery> rays, LidarHit* hits) override {
    RTCIntersectContext context = coherent();
    alignas(64) int valid[kWidth];
    std::fill(std::begin(valid), std::end(valid), -1);
    for (size_t begin = 0; begin < rays.size(); begin += kWidth) {
      Packet packet;
      for (size_t i = 0; i < kWidth; ++i) set_lane(packet, i, rays[begin + i]);
      intersect(valid, scene_->get(), &context, &packet);
      for (size_t i = 0; i < kWidth; ++i)
        *hits++ = hit_of(packet.ray.tfar[i], packet.hit.geomID[i], packet.hit.instID[0][i]);
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
    packet.ray.tnear[lane] = packet.ray.time[lane] = 0;
    packet.ray.tfar[lane] = ray.t_max;
    packet.ray.mask[lane] = ~0u;
    packet.ray.flags[lane] = 0;
    packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
  }
  std::shared_ptr<const LidarScene> scene_;
};

}  // namespace

std::vector<std::unique_ptr<LidarPeer>> embree_lidars(const BenchMesh& mesh, const std::vector<LidarBox>& boxes) {
  const auto scene = std::make_shared<LidarScene>(mesh, boxes);
  std::vector<std::unique_ptr<LidarPeer>> peers;
  peers.push_back(std::make_unique<Stream<1>>(scene));
  peers.push_back(std::make_unique<Stream<1024>>(scene));
  peers.push_back(std::make_unique<Packets<RTCRayHit8, 8>>(scene));
  peers.push_back(std::make_unique<Packets<RTCRayHit16, 16>>(scene));
  return peers;
}

}  // namespace locus::bench::queries
