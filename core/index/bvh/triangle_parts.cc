#include "core/index/bvh/triangle_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace locus {
namespace {

// Coordinates of a box that no slab test meets.
constexpr float kNowhere = 1e30f;

using Orders = std::array<uint32_t, 8>;  // one for each octant of directions

// How far each octant meets a box along its diagonal. A quarter of each coordinate, so that sums stay finite.
std::array<float, 8> corners_toward(const Aabbf& box) {
  std::array<float, 8> result;
  for (uint32_t octant = 0; octant < 8; ++octant) {
    float sum = 0;
    for (int axis = 0; axis < 3; ++axis) sum += 0.25f * ((octant >> axis & 1u) != 0 ? -box.max[axis] : box.min[axis]);
    result[octant] = sum;
  }
  return result;
}

// Slots from far to near along the diagonal of each octant, equal ones by number, behind those without a child. A
// slot's place is the number of slots that stand before it: all octants are ranked at once, without a branch.
Orders orders_of(absl::Span<const Aabbf> boxes) {
  std::array<std::array<float, 8>, kTreeWidth> corners;
  std::array<Orders, kTreeWidth> places{};
  const auto used = static_cast<uint32_t>(boxes.size());
  for (uint32_t slot = 0; slot < used; ++slot) {
    corners[slot] = corners_toward(boxes[slot]);
    for (uint32_t before = 0; before < slot; ++before) {
      for (size_t octant = 0; octant < 8; ++octant) {
        const uint32_t farther = corners[slot][octant] > corners[before][octant] ? 1 : 0;
        places[before][octant] += farther;
        places[slot][octant] += 1 - farther;
      }
    }
  }
  Orders orders{};
  for (uint32_t slot = 0; slot < kTreeWidth; ++slot) {
    const uint32_t empty = kTreeWidth - used;
    for (size_t octant = 0; octant < 8; ++octant) {
      const uint32_t place = slot < used ? empty + places[slot][octant] : slot - used;
      orders[octant] |= slot << (3 * place);
    }
  }
  return orders;
}

float rounded_up_extent(const Aabbf& box) {
  return std::nextafter(max_component(box.extent()), std::numeric_limits<float>::infinity());
}

}  // namespace

void fill_boxes(absl::Span<const Aabbf> boxes, TriangleNode& node) {
  for (uint32_t slot = 0; slot < kTreeWidth; ++slot) {
    const bool used = slot < boxes.size();
    for (int axis = 0; axis < 3; ++axis) {
      node.bounds[axis][slot] = used ? boxes[slot].min[axis] : kNowhere;
      node.bounds[3 + axis][slot] = used ? boxes[slot].max[axis] : -kNowhere;
    }
  }
  const Orders orders = orders_of(boxes);
  std::copy(orders.begin(), orders.end(), node.order);
}

void fill_block(absl::Span<const Triangle> triangles, const Aabbf& box, uint32_t first, TriangleBlock& block) {
  block.first = first;
  block.count = static_cast<uint32_t>(triangles.size());
  block.extent = rounded_up_extent(box);
  std::fill(std::begin(block.unused), std::end(block.unused), 0);
  for (uint32_t lane = 0; lane < kTreeWidth; ++lane) {
    const Triangle& triangle = triangles[std::min(lane, block.count - 1)];
    int row = 0;
    for (const Vec3f vertex : {triangle.a, triangle.b, triangle.c})
      for (int axis = 0; axis < 3; ++axis) block.vertices[row++][lane] = vertex[axis];
  }
}

}  // namespace locus
