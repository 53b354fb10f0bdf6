#include "core/query/kinds/object_boxes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/container/inlined_vector.h"
#include "core/geometry/float_step.h"

namespace locus {
namespace {

// Returns a box in float that contains `box`.
Aabbf rounded_out(const Aabbd& box) {
  Aabbf result;
  for (int axis = 0; axis < 3; ++axis) {
    result.min[axis] = -next_above(static_cast<float>(-box.min[axis]));
    result.max[axis] = next_above(static_cast<float>(box.max[axis]));
  }
  return result;
}

// Returns `value`, of 10 bits, with two zero bits after each bit.
uint32_t spread_bits(uint32_t value) {
  value = (value | value << 16) & 0x030000FFu;
  value = (value | value << 8) & 0x0300F00Fu;
  value = (value | value << 4) & 0x030C30C3u;
  return (value | value << 2) & 0x09249249u;
}

// Returns the place of a box along a Morton curve through `bounds`, on which boxes close together have close places.
uint32_t place_of(const Aabbf& box, const Aabbf& bounds) {
  uint32_t place = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float length = bounds.max[axis] - bounds.min[axis];
    const float part = length > 0 ? ((box.min[axis] + box.max[axis]) * 0.5f - bounds.min[axis]) / length : 0;
    place |= spread_bits(static_cast<uint32_t>(std::clamp(part, 0.0f, 1.0f) * 1023)) << axis;
  }
  return place;
}

}  // namespace

void ObjectBoxes::Sides::resize(size_t boxes) {
  const size_t count = (boxes + kCluster - 1) / kCluster * kCluster;
  for (int side = 0; side < 6; ++side)
    sides[side].assign(count,
                       side < 3 ? std::numeric_limits<float>::infinity() : -std::numeric_limits<float>::infinity());
}

void ObjectBoxes::Sides::set(size_t index, const Aabbf& box) {
  for (int axis = 0; axis < 3; ++axis) {
    sides[axis][index] = box.min[axis];
    sides[axis + 3][index] = box.max[axis];
  }
}

ObjectBoxes::ObjectBoxes(const ObjectSet& objects) {
  struct Placed {
    uint32_t place;
    Aabbf box;
    GridRef object;
  };
  std::vector<Placed> placed;
  placed.reserve(objects.size());
  Aabbf bounds;
  objects.grid().for_each([&](const GridRef& object) {
    placed.push_back({0, rounded_out(bounds_of(object, shape_of(object))), object});
    bounds = placed.size() == 1 ? placed[0].box : merge(bounds, placed.back().box);
    return true;
  });
  for (Placed& one : placed) one.place = place_of(one.box, bounds);
  std::sort(placed.begin(), placed.end(), [](const Placed& a, const Placed& b) { return a.place < b.place; });
  if (!placed.empty()) magnitude_ = magnitude(bounds);
  boxes_.resize(placed.size());
  clusters_.resize((placed.size() + kCluster - 1) / kCluster);
  objects_.reserve(placed.size());
  for (size_t i = 0; i < placed.size(); ++i) {
    boxes_.set(i, placed[i].box);
    objects_.push_back(placed[i].object);
  }
  for (size_t first = 0; first < placed.size(); first += kCluster) {
    Aabbf all = placed[first].box;
    for (size_t i = first; i < std::min(first + kCluster, placed.size()); ++i) all = merge(all, placed[i].box);
    clusters_.set(first / kCluster, all);
  }
}

// The pad covers the rounding of the origin, the slopes and the products: at most 16 roundings of 2^-24 of the largest
// |coordinate| of the origin and the boxes, since no slope is larger than 1.5.
class ObjectBoxes::BeamTest {
 public:
  BeamTest(const RayBeam& beam, float max_depth, float magnitude) : beam_(beam), axes_(beam.axes_), max_(max_depth) {
    const double reach = max_component(abs(beam.origin_)) + double{magnitude};
    pad_ = static_cast<float>(0x1p-19 * reach);
    for (int k = 0; k < 3; ++k) origin_[k] = static_cast<float>(beam.origin_[axes_[k]]);
  }

  // Appends the boxes, of those at the indices first .. first + kCluster - 1, that the beam may enter.
  template <class Boxes>
  void append(const Sides& boxes, size_t first, Boxes& found) const {
    const float* const near = &boxes.sides[axes_[0] + (beam_.sign_ > 0 ? 0 : 3)][first];
    const float* const far = &boxes.sides[axes_[0] + (beam_.sign_ > 0 ? 3 : 0)][first];
    float enters[kCluster], leaves[kCluster];
    int32_t met[kCluster];
    for (size_t i = 0; i < kCluster; ++i) {
      const float enter = (near[i] - origin_[0]) * beam_.sign_ - pad_,
                  leave = (far[i] - origin_[0]) * beam_.sign_ + pad_;
      enters[i] = enter > 0 ? enter : 0;
      leaves[i] = leave < max_ ? leave : max_;
      met[i] = enters[i] <= leaves[i] ? 1 : 0;
    }
    for (int k = 0; k < 2; ++k) {
      const float* const low = &boxes.sides[axes_[k + 1]][first];
      const float* const high = &boxes.sides[axes_[k + 1] + 3][first];
      const float least = beam_.low_[k], greatest = beam_.high_[k], from = origin_[k + 1];
      for (size_t i = 0; i < kCluster; ++i) {
        const float a = least * enters[i], b = least * leaves[i], c = greatest * enters[i], d = greatest * leaves[i];
        const float lowest = a < b ? a : b, highest = c > d ? c : d;
        met[i] &= (low[i] - from - pad_ <= highest ? 1 : 0) & (high[i] - from + pad_ >= lowest ? 1 : 0);
      }
    }
    for (size_t i = 0; i < kCluster; ++i)
      if (met[i] != 0) found.push_back({enters[i], static_cast<uint32_t>(first + i)});
  }

 private:
  const RayBeam& beam_;
  const int* const axes_;
  const float max_;
  float pad_, origin_[3];
};

void ObjectBoxes::find(const RayBeam& beam, float max_depth, std::vector<Found>& found, Work& work) const {
  const BeamTest test(beam, std::min(max_depth, std::numeric_limits<float>::max()), magnitude_);
  absl::InlinedVector<Found, 64> clusters;
  for (size_t first = 0; first < clusters_.sides[0].size(); first += kCluster) test.append(clusters_, first, clusters);
  work.cells += clusters_.sides[0].size() / kCluster + clusters.size();
  found.clear();
  for (const Found& cluster : clusters) test.append(boxes_, cluster.index * kCluster, found);
  std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) { return a.depth < b.depth; });
}

Aabbd ObjectBoxes::box(uint32_t index) const {
  Aabbf box;
  for (int axis = 0; axis < 3; ++axis) {
    box.min[axis] = boxes_.sides[axis][index];
    box.max[axis] = boxes_.sides[axis + 3][index];
  }
  return to_double(box);
}

}  // namespace locus
