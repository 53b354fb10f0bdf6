#include "tests/bench/static/embree_collide.h"

#include <embree3/rtcore.h>

#include <algorithm>

#include "tests/bench/static/scalar_overlap.h"

namespace locus::bench {
namespace {

RTCDevice device() {
  static const RTCDevice only = rtcNewDevice("threads=1");
  return only;
}

void set(RTCBounds* to, const Aabbf& bounds) {
  to->lower_x = bounds.min.x;
  to->lower_y = bounds.min.y;
  to->lower_z = bounds.min.z;
  to->upper_x = bounds.max.x;
  to->upper_y = bounds.max.y;
  to->upper_z = bounds.max.z;
}

// Returns a committed scene of user geometry, for which Embree gets only the bounds of each of `things`.
template <class Thing>
RTCScene scene_of(const Thing* things, size_t count, RTCBoundsFunction bounds, RTCBuildQuality quality) {
  const RTCScene scene = rtcNewScene(device());
  rtcSetSceneBuildQuality(scene, quality);
  const RTCGeometry geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(count));
  rtcSetGeometryUserData(geometry, const_cast<Thing*>(things));
  rtcSetGeometryBoundsFunction(geometry, bounds, nullptr);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
  return scene;
}

void bounds_of_triangle(const RTCBoundsFunctionArguments* asked) {
  set(asked->bounds_o, bounds_of(static_cast<const Triangle*>(asked->geometryUserPtr)[asked->primID]));
}
void bounds_of_box(const RTCBoundsFunctionArguments* asked) {
  set(asked->bounds_o, ends_of(static_cast<const Obbf*>(asked->geometryUserPtr)[asked->primID]));
}

class EmbreeCollide : public Peer {
 public:
  explicit EmbreeCollide(const BenchMesh& mesh)
      : Peer("embree_collide"),
        triangles_(mesh.triangles),
        scene_(scene_of(triangles_.data(), triangles_.size(), bounds_of_triangle, RTC_BUILD_QUALITY_MEDIUM)) {}
  ~EmbreeCollide() override { rtcReleaseScene(scene_); }
  EmbreeCollide(const EmbreeCollide&) = delete;
  EmbreeCollide& operator=(const EmbreeCollide&) = delete;

  bool does(Task task) const override { return task == Task::kBox; }
  // Appends ids to `ids` in the order in which rtcCollide finds pairs, not sorted by box; continues at the start of
  // `ids` when it is full.
  void box_ids(absl::Span<const Obbf> boxes, absl::Span<uint32_t> ids, uint32_t* counts) override {
    std::fill_n(counts, boxes.size(), 0);
    Found found{triangles_, boxes, ids, counts, 0};
    const RTCScene asked = scene_of(boxes.data(), boxes.size(), bounds_of_box, RTC_BUILD_QUALITY_LOW);
    rtcCollide(asked, scene_, decide, &found);
    rtcReleaseScene(asked);
  }

 private:
  struct Found {
    const std::vector<Triangle>& triangles;
    absl::Span<const Obbf> boxes;
    absl::Span<uint32_t> ids;
    uint32_t* counts;
    size_t next;
  };

  static void decide(void* into, RTCCollision* pairs, unsigned count) {
    Found& found = *static_cast<Found*>(into);
    for (const RTCCollision& pair : absl::MakeConstSpan(pairs, count)) {
      const Obbf& box = found.boxes[pair.primID0];
      if (!scalar_box_overlaps(box.center, box.half, found.triangles[pair.primID1])) continue;
      found.ids[found.next] = pair.primID1;
      found.next = found.next + 1 == found.ids.size() ? 0 : found.next + 1;
      ++found.counts[pair.primID0];
    }
  }

  const std::vector<Triangle>& triangles_;
  RTCScene scene_;
};

}  // namespace

void add_embree_collide_peer(const BenchMesh& mesh, Needs needs, Peers& peers) {
  if (needs.regions) peers.push_back(std::make_unique<EmbreeCollide>(mesh));
}

}  // namespace locus::bench
