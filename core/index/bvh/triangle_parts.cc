#include "core/index/bvh/triangle_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/check.h"

namespace locus {
namespace {

// Bound of the boxes of unused slots: min = +kUnusedBound and max = -kUnusedBound, so that no test hits such a box.
constexpr float kUnusedBound = 1e30f;

using OctantOrders = std::array<uint32_t, 8>;  // TriangleNode::order: one element for each octant of ray directions

// Returns, for each octant of ray directions, the distance of the box's nearest corner along the octant's diagonal. All
// distances are scaled by the same factor, chosen so that the sum of three coordinates stays finite.
std::array<float, 8> corner_distances(const Aabbf& box) {
  std::array<float, 8> result;
  for (uint32_t octant = 0; octant < 8; ++octant) {
    float sum = 0;
    for (int axis = 0; axis < 3; ++axis) sum += 0.25f * ((octant >> axis & 1u) != 0 ? -box.max[axis] : box.min[axis]);
    result[octant] = sum;
  }
  return result;
}

// Returns, for each octant, the order of slots from far to near along the octant's diagonal. Unused slots come first;
// slots at equal distances are in increasing order. A slot's rank is the number of slots before it; the ranks for all
// octants are computed together, without a branch.
OctantOrders orders_of(absl::Span<const Aabbf> boxes) {
  std::array<std::array<float, 8>, kTreeWidth> distances;
  std::array<OctantOrders, kTreeWidth> ranks{};
  const auto used = static_cast<uint32_t>(boxes.size());
  for (uint32_t slot = 0; slot < used; ++slot) {
    distances[slot] = corner_distances(boxes[slot]);
    for (uint32_t before = 0; before < slot; ++before) {
      for (size_t octant = 0; octant < 8; ++octant) {
        const uint32_t farther = distances[slot][octant] > distances[before][octant] ? 1 : 0;
        ranks[before][octant] += farther;
        ranks[slot][octant] += 1 - farther;
      }
    }
  }
  OctantOrders orders{};
  for (uint32_t slot = 0; slot < kTreeWidth; ++slot) {
    const uint32_t unused_count = kTreeWidth - used;
    for (size_t octant = 0; octant < 8; ++octant) {
      const uint32_t rank = slot < used ? unused_count + ranks[slot][octant] : slot - used;
      orders[octant] |= slot << (3 * rank);
    }
  }
  return orders;
}

// Returns the longest side of a box, rounded up to the next float.
float rounded_up_extent(const Aabbf& box) {
  return std::nextafter(max_component(box.extent()), std::numeric_limits<float>::infinity());
}

}  // namespace

void fill_boxes(absl::Span<const Aabbf> boxes, TriangleNode& node) {
  LOCUS_DCHECK(!boxes.empty());
  LOCUS_DCHECK_LE(boxes.size(), size_t{kTreeWidth});
  for (uint32_t slot = 0; slot < kTreeWidth; ++slot) {
    const bool used = slot < boxes.size();
    LOCUS_DCHECK(!used || !boxes[slot].empty());
    for (int axis = 0; axis < 3; ++axis) {
      node.bounds[axis][slot] = used ? boxes[slot].min[axis] : kUnusedBound;
      node.bounds[3 + axis][slot] = used ? boxes[slot].max[axis] : -kUnusedBound;
    }
  }
  const OctantOrders orders = orders_of(boxes);
  std::copy(orders.begin(), orders.end(), node.order);
}

void fill_block(absl::Span<const Triangle> triangles, const Aabbf& box, uint32_t first, TriangleBlock& block) {
  LOCUS_DCHECK(!triangles.empty());
  LOCUS_DCHECK_LE(triangles.size(), size_t{kTreeWidth});
  block.first = first;
  block.count = static_cast<uint32_t>(triangles.size());
  block.extent = rounded_up_extent(box);
  std::fill(std::begin(block.unused), std::end(block.unused), 0);
  for (uint32_t lane = 0; lane < kTreeWidth; ++lane) {
    const Triangle& triangle = triangles[std::min(lane, block.count - 1)];
    LOCUS_DCHECK(contains(box, bounds_of(triangle)));
    int row = 0;
    for (const Vec3f vertex : {triangle.a, triangle.b, triangle.c})
      for (int axis = 0; axis < 3; ++axis) block.vertices[row++][lane] = vertex[axis];
  }
}

}  // namespace locus
