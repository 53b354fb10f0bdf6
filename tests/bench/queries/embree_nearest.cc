#include <embree3/rtcore.h>

#include <cmath>
#include <limits>
#include <vector>

#include "tests/bench/queries/nearest_cases.h"

namespace locus::bench::queries {
namespace {

// Returns the point of a triangle nearest to `p`.
// Source: Ericson, Real-Time Collision Detection, 2005, 5.1.5, as in Embree's tutorial closest_point.
inline Vec3f nearest_on(Vec3f p, const Triangle& triangle) {
  const Vec3f a = triangle.a, b = triangle.b, c = triangle.c;
  const Vec3f ab = b - a, ac = c - a, ap = p - a;
  const float d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Vec3f bp = p - b;
  const float d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const Vec3f cp = p - c;
  const float d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / (d1 - d3));
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / (d2 - d6));
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && (d4 - d3) >= 0 && (d5 - d6) >= 0) return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  const float scale = 1 / (va + vb + vc);
  return a + ab * (vb * scale) + ac * (vc * scale);
}

class EmbreeNearest : public NearestPeer {
 public:
  explicit EmbreeNearest(const BenchMesh& mesh)
      : triangles_(mesh.triangles),
        vertices_(mesh.vertices),
        indices_(mesh.indices),
        device_(rtcNewDevice("threads=1")) {
    vertices_.resize(vertices_.size() + 4);  // Embree reads beyond the last vertex
    scene_ = rtcNewScene(device_);
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_MEDIUM);
    const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, vertices_.data(), 0,
                               3 * sizeof(float), (vertices_.size() - 4) / 3);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, indices_.data(), 0,
                               3 * sizeof(uint32_t), indices_.size() / 3);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }
  ~EmbreeNearest() override {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  EmbreeNearest(const EmbreeNearest&) = delete;
  EmbreeNearest& operator=(const EmbreeNearest&) = delete;

  void nearest(absl::Span<const Vec3f> points, NearestTriangle* answers) override {
    for (const Vec3f& point : points) {
      Found found{triangles_, point, kNoTriangle};
      RTCPointQuery query;
      query.x = point.x;
      query.y = point.y;
      query.z = point.z;
      query.radius = std::numeric_limits<float>::infinity();
      query.time = 0;
      RTCPointQueryContext context;
      rtcInitPointQueryContext(&context);
      rtcPointQuery(scene_, &query, &context, offer, &found);
      *answers++ = {query.radius, found.triangle};
    }
  }

 private:
  struct Found {
    const std::vector<Triangle>& triangles;
    Vec3f point;
    uint32_t triangle;
  };

  // Stores a triangle that is nearer than the query's radius, and shrinks the radius to its distance. Returns whether
  // the triangle was nearer.
  static bool offer(RTCPointQueryFunctionArguments* arguments) {
    Found& found = *static_cast<Found*>(arguments->userPtr);
    const Vec3f nearest = nearest_on(found.point, found.triangles[arguments->primID]);
    const float distance = std::sqrt(squared_length(nearest - found.point));
    if (!(distance < arguments->query->radius)) return false;
    arguments->query->radius = distance;
    found.triangle = arguments->primID;
    return true;
  }

  const std::vector<Triangle>& triangles_;
  std::vector<float> vertices_;
  std::vector<uint32_t> indices_;
  RTCDevice device_;
  RTCScene scene_;
};

}  // namespace

std::unique_ptr<NearestPeer> embree_nearest(const BenchMesh& mesh) { return std::make_unique<EmbreeNearest>(mesh); }

}  // namespace locus::bench::queries
