// Tree over triangles in long double. It shares vectors, triangles and boxes with the product, but no ray test and no
// tree. The tree makes it possible to verify more rays than a plain list of triangles does. It is split at medians, and
// its boxes in double are widened by far more than any rounding error of the box test. Used by the proof that no ray
// misses. A test compares the results of the tree with those of a plain list. Immutable after construction; safe from
// any thread.
#ifndef LOCUS_TESTS_SUPPORT_PROOF_REFERENCE_TREE_H_
#define LOCUS_TESTS_SUPPORT_PROOF_REFERENCE_TREE_H_

#include <array>
#include <cstdint>
#include <numeric>
#include <vector>

#include "core/geometry/aabb.h"
#include "tests/support/proof/real_triangle.h"

namespace locus::test {

class ReferenceTree {
 public:
  // Builds the tree. The number of a triangle is its index in `triangles`, which must not be empty.
  explicit ReferenceTree(const std::vector<Triangle>& triangles) : order_(triangles.size()) {
    std::vector<Aabbd> boxes;
    for (const Triangle& triangle : triangles) {
      triangles_.emplace_back(triangle);
      rough_.push_back(rough(triangle));
      boxes.push_back(to_double(bounds_of(triangle)));
    }
    std::iota(order_.begin(), order_.end(), 0u);
    build(boxes);
    magnitude_ = locus::magnitude(nodes_[0].box);
  }

  const RealTriangle& triangle(uint32_t number) const { return triangles_[number]; }
  uint32_t size() const { return static_cast<uint32_t>(triangles_.size()); }

  // Calls visit(number, meeting) for every triangle that the ray meets within the triangle's border at 0 <= t <= limit.
  // Also calls it for some triangles whose plane the ray meets outside the border: their inset is negative. The visitor
  // may lower `limit`.
  template <class Visit>
  void visit(const RealRay& ray, const Real& limit, Visit visit) const {
    const RoughRay rough_ray(ray, magnitude_);
    std::array<uint32_t, kMaxDepth> waiting;
    size_t count = 0;
    waiting[count++] = 0;
    while (count != 0) {
      const Node& node = nodes_[waiting[--count]];
      if (!rough_ray.meet(node.box, static_cast<double>(limit))) continue;
      if (node.count == 0) {
        waiting[count++] = node.first;
        waiting[count++] = node.first + 1;
      }
      for (uint32_t i = 0; i < node.count; ++i) {
        const uint32_t number = order_[node.first + i];
        if (!rough_ray.may_meet(rough_[number], static_cast<double>(limit))) continue;
        if (const std::optional<Meeting> meeting = triangles_[number].meet(ray, limit)) visit(number, *meeting);
      }
    }
  }

 private:
  static constexpr size_t kMaxDepth = 64;  // each split halves the triangles, so at most 32 levels are needed
  static constexpr uint32_t kLeafSize = 4;

  struct Node {
    Aabbd box;
    // Position of the first triangle in `order_` for a leaf. For an inner node, the index of its first child; the
    // second child follows the first.
    uint32_t first;
    uint32_t count;  // number of triangles of a leaf; 0 for an inner node
  };

  // A triangle in double: a point p of its plane has normal . p = level. A point p within the triangle also has
  // inward[i] . p >= border[i] for each edge i.
  struct Rough {
    Vec3d normal, inward[3];
    double level, border[3];
  };

  // A ray in double. `reach` is, on each axis, an upper bound of the length on which the ray is tested. Rounding of the
  // ray and of the test moves the ray by about 2^-51 of the reach; the pad is 2^-30 of the reach.
  struct RoughRay {
    RoughRay(const RealRay& ray, double magnitude) {
      double reach = magnitude;
      for (int axis = 0; axis < 3; ++axis) {
        origin[axis] = static_cast<double>(ray.origin[axis]);
        direction[axis] = static_cast<double>(ray.direction[axis]);
        reach = std::max(reach, std::abs(origin[axis]) + magnitude);
        longest = std::max(longest, std::abs(direction[axis]));
      }
      pad = 0x1p-30 * reach;
      for (int axis = 0; axis < 3; ++axis) {
        // Treat the ray as parallel to the planes of a slab if its direction component across them is tiny: then the
        // ray's distance from the planes changes by far less than the pad over the whole reach.
        parallel[axis] = std::abs(direction[axis]) < 1e-25 * longest;
        inverse[axis] = parallel[axis] ? 0 : 1 / direction[axis];
      }
    }

    bool meet(const Aabbd& box, double limit) const {
      double near = 0, far = limit * (1 + 0x1p-40);
      for (int axis = 0; axis < 3; ++axis) {
        const double low = box.min[axis] - pad - origin[axis], high = box.max[axis] + pad - origin[axis];
        if (parallel[axis]) {
          if (low > 0 || high < 0) return false;
          continue;
        }
        near = std::max(near, std::min(low * inverse[axis], high * inverse[axis]));
        far = std::min(far, std::max(low * inverse[axis], high * inverse[axis]));
      }
      return near <= far;
    }

    // Returns true if a hit is possible, and sometimes if no hit is possible. Always returns true for rays almost
    // parallel to the triangle. For any other ray, the error of the point where the ray meets the plane is about 2^-30
    // of the reach, and the tolerance of four pads is 2^-28 of the reach.
    bool may_meet(const Rough& triangle, double limit) const {
      const double slope = dot(triangle.normal, direction);
      if (std::abs(slope) < 0x1p-20 * longest) return true;
      const double t = (triangle.level - dot(triangle.normal, origin)) / slope, slack = 4 * pad / longest;
      if (t < -slack || t > limit + slack) return false;
      const Vec3d point = origin + direction * t;
      return dot(triangle.inward[0], point) >= triangle.border[0] - 4 * pad &&
             dot(triangle.inward[1], point) >= triangle.border[1] - 4 * pad &&
             dot(triangle.inward[2], point) >= triangle.border[2] - 4 * pad;
    }

    Vec3d origin, direction;
    double inverse[3], longest = 0, pad;
    bool parallel[3];
  };

  static Rough rough(const Triangle& triangle) {
    const Vec3r corners[] = {to_real(triangle.a), to_real(triangle.b), to_real(triangle.c)};
    const Vec3r normal = unit(cross(corners[1] - corners[0], corners[2] - corners[0]));
    Rough rough{narrowed(normal), {}, static_cast<double>(dot(normal, corners[0])), {}};
    for (int i = 0; i < 3; ++i) {
      const Vec3r inward = unit(cross(normal, corners[(i + 1) % 3] - corners[i]));
      rough.inward[i] = narrowed(inward);
      rough.border[i] = static_cast<double>(dot(inward, corners[i]));
    }
    return rough;
  }
  static Vec3d narrowed(Vec3r v) {
    return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
  }

  void build(const std::vector<Aabbd>& boxes) {
    nodes_.push_back({{}, 0, size()});
    for (size_t i = 0; i < nodes_.size(); ++i) {
      const uint32_t first = nodes_[i].first, count = nodes_[i].count;
      Aabbd centers;
      for (uint32_t k = first; k < first + count; ++k) {
        const Aabbd& box = boxes[order_[k]];
        nodes_[i].box = merge(nodes_[i].box, box);
        centers = merge(centers, box.min + box.max);
      }
      if (count <= kLeafSize) continue;
      const Vec3d extent = centers.extent();
      const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
      const auto begin = order_.begin() + first;
      std::nth_element(begin, begin + count / 2, begin + count, [&](uint32_t a, uint32_t b) {
        return boxes[a].min[axis] + boxes[a].max[axis] < boxes[b].min[axis] + boxes[b].max[axis];
      });
      nodes_[i].first = static_cast<uint32_t>(nodes_.size());
      nodes_[i].count = 0;
      nodes_.push_back({{}, first, count / 2});
      nodes_.push_back({{}, first + count / 2, count - count / 2});
    }
  }

  std::vector<RealTriangle> triangles_;
  std::vector<Rough> rough_;
  std::vector<uint32_t> order_;
  std::vector<Node> nodes_;
  double magnitude_ = 0;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_PROOF_REFERENCE_TREE_H_
