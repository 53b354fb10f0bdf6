// Boxes of all moving objects of one revision, for beams: sixteen rays from one point in similar directions. A search
// of the grid costs the same for each ray. A beam is tested once with clusters of boxes and with the boxes in the
// clusters that it meets, and each ray is tested only with the boxes that the beam meets. To build the boxes costs
// about as much as to search the grid with half as many rays as there are objects: see BatchControl::object_boxes().
//
// Threads: immutable after construction. Culling is conservative: a beam meets the box of every object that one of its
// rays hits within the limit of the beam.
#ifndef LOCUS_CORE_QUERY_KINDS_OBJECT_BOXES_H_
#define LOCUS_CORE_QUERY_KINDS_OBJECT_BOXES_H_

#include <cstdint>
#include <optional>
#include <vector>

#include "absl/types/span.h"
#include "core/geometry/ray.h"
#include "core/index/work.h"
#include "core/scene/objects/object_set.h"

namespace locus {

// Rays from one point in similar directions. Depth is the distance along the axis of the longest component of the
// directions; a slope is the quotient of another component and the longest one.
class RayBeam {
 public:
  static constexpr size_t kRays = 16;

  // Makes a beam of kRays rays with the same origin. Returns nullopt if the longest components of the directions differ
  // in axis or sign, or if the slopes differ too much for the beam to be worth it. `direction_of` returns the direction
  // of each ray.
  template <class DirectionOf>
  static std::optional<RayBeam> of(const Vec3d& origin, const DirectionOf& direction_of);

  // Returns the depth that ray `direction` reaches at `t`.
  float depth(const Vec3d& direction, float t) const {
    return static_cast<float>(double{t} * std::abs(direction[axes_[0]]) * (1 + 0x1p-20));
  }

 private:
  friend class ObjectBoxes;
  static constexpr double kMaxSlopes = 0.5;  // greatest difference of slopes

  Vec3d origin_;
  int axes_[3];             // the axis of depth, then the others
  float sign_;              // of the direction along the axis of depth
  float low_[2], high_[2];  // bounds of the slopes along the other axes
};

class ObjectBoxes {
 public:
  explicit ObjectBoxes(const ObjectSet& objects);

  // Object whose box a beam may enter; no ray enters it at a lower depth.
  struct Found {
    float depth;
    uint32_t index;
  };

  // Writes the objects whose boxes the beam may enter at a depth of at most `max_depth`, by ascending depth.
  void find(const RayBeam& beam, float max_depth, std::vector<Found>& found, Work& work) const;

  const GridRef& object(uint32_t index) const { return objects_[index]; }
  // Returns a box around the bounds of the object.
  Aabbd box(uint32_t index) const;

 private:
  static constexpr size_t kCluster = 16;
  // Sides of boxes: minima along x, y, z, then maxima. The number of boxes is a multiple of kCluster; the last boxes
  // are empty.
  struct Sides {
    std::vector<float> sides[6];
    void resize(size_t boxes);
    void set(size_t index, const Aabbf& box);
  };
  // Test of one beam with kCluster boxes at a time.
  class BeamTest;

  std::vector<GridRef> objects_;
  Sides boxes_, clusters_;
  float magnitude_ = 0;  // largest |coordinate| of a box
};

template <class DirectionOf>
std::optional<RayBeam> RayBeam::of(const Vec3d& origin, const DirectionOf& direction_of) {
  const Vec3d first = direction_of(0), size = abs(first);
  RayBeam beam;
  beam.origin_ = origin;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  for (int k = 0; k < 3; ++k) beam.axes_[k] = (axis + k) % 3;
  beam.sign_ = first[axis] < 0 ? -1.0f : 1.0f;
  double low[2] = {4, 4}, high[2] = {-4, -4};
  for (size_t i = 0; i < kRays; ++i) {
    const Vec3d direction = direction_of(i);
    const double along = direction[axis] * double{beam.sign_};
    if (!(along > 0)) return std::nullopt;
    const double reciprocal = 1 / along;
    for (int k = 0; k < 2; ++k) {
      const double slope = direction[beam.axes_[k + 1]] * reciprocal;
      low[k] = std::min(low[k], slope);
      high[k] = std::max(high[k], slope);
      if (!(high[k] - low[k] <= kMaxSlopes)) return std::nullopt;
    }
  }
  for (int k = 0; k < 2; ++k) {
    beam.low_[k] = static_cast<float>(low[k]);
    beam.high_[k] = static_cast<float>(high[k]);
  }
  return beam;
}

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_OBJECT_BOXES_H_
