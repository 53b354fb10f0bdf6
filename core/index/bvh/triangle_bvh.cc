#include "core/index/bvh/triangle_bvh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/base/check.h"
#include "core/base/limits.h"

namespace locus {

static_assert(kBvhWidth == kTreeWidth && kBvhLeafSize == kTreeWidth);
static_assert(kTreeStack == limits::kMaxBvhDepth * (kTreeWidth - 1) + 1 + kTreeWidth);

namespace {

// Coordinates of a box that no slab test meets.
constexpr float kNowhere = 1e30f;

float corner_toward(const Aabbf& box, uint32_t octant) {
  float sum = 0;
  for (int axis = 0; axis < 3; ++axis) sum += (octant >> axis & 1u) != 0 ? -box.max[axis] : box.min[axis];
  return sum;
}

// Slots from far to near along the diagonal of each octant of directions.
void write_order(absl::Span<const Aabbf> boxes, TriangleNode& node) {
  for (uint32_t octant = 0; octant < 8; ++octant) {
    std::array<uint32_t, kTreeWidth> slots{};
    for (uint32_t slot = 0; slot < kTreeWidth; ++slot) slots[slot] = slot;
    const auto farther = [&](uint32_t a, uint32_t b) {
      const bool a_empty = a >= boxes.size(), b_empty = b >= boxes.size();
      if (a_empty || b_empty) return a_empty && !b_empty;
      return corner_toward(boxes[a], octant) > corner_toward(boxes[b], octant);
    };
    std::stable_sort(slots.begin(), slots.end(), farther);
    node.order[octant] = 0;
    for (int place = 0; place < kTreeWidth; ++place)
      node.order[octant] |= slots[static_cast<size_t>(place)] << (3 * place);
  }
}

float rounded_up_extent(const Aabbf& box) {
  return std::nextafter(max_component(box.extent()), std::numeric_limits<float>::infinity());
}

}  // namespace

// Turns the builder's layout into nodes and blocks, children by rising area, everything depth-first.
class TriangleBvh::Writer {
 public:
  Writer(absl::Span<const Triangle> triangles, const BvhLayout<float>& layout, TriangleBvh& tree)
      : triangles_(triangles), layout_(layout), tree_(tree) {}

  void write() {
    tree_.nodes_.reserve(layout_.nodes.size());
    tree_.ranges_.reserve(layout_.nodes.size());
    tree_.numbers_.reserve(triangles_.size());
    size_t blocks = 0;
    for (const BvhNode<float>& node : layout_.nodes)
      for (uint32_t slot = 0; slot < node.child_count; ++slot) blocks += node.children[slot].is_leaf() ? 1 : 0;
    tree_.blocks_.reserve(blocks);
    open(0);
    while (!path_.empty()) {
      Open& now = path_.back();
      const BvhNode<float>& from = layout_.nodes[now.from];
      if (now.next == from.child_count) {
        NodeRange& range = tree_.ranges_[now.to];
        range.count = static_cast<uint32_t>(tree_.numbers_.size()) - range.first;
        path_.pop_back();
        continue;
      }
      const uint32_t slot = now.next++;
      const uint32_t source = now.slots[slot];
      const BvhChild& child = from.children[source];
      const uint32_t to = now.to;
      tree_.nodes_[to].child[slot] = child.is_leaf() ? add_block(child, from.bounds[source]) : open(child.first);
    }
  }

 private:
  struct Open {
    uint32_t from, to;  // the node of the layout, and of the tree
    uint32_t next = 0;  // slot to fill
    std::array<uint32_t, kTreeWidth> slots{};
  };

  uint32_t open(uint32_t from) {
    const BvhNode<float>& node = layout_.nodes[from];
    const auto to = static_cast<uint32_t>(tree_.nodes_.size());
    Open& opened = path_.emplace_back();
    opened.from = from;
    opened.to = to;
    for (uint32_t slot = 0; slot < node.child_count; ++slot) opened.slots[slot] = slot;
    std::stable_sort(opened.slots.begin(), opened.slots.begin() + node.child_count,
                     [&](uint32_t a, uint32_t b) { return half_area(node.bounds[a]) < half_area(node.bounds[b]); });
    tree_.ranges_.push_back({static_cast<uint32_t>(tree_.numbers_.size()), 0});
    TriangleNode& written = tree_.nodes_.emplace_back();
    std::array<Aabbf, kTreeWidth> boxes;
    for (uint32_t slot = 0; slot < kTreeWidth; ++slot) {
      const bool used = slot < node.child_count;
      if (used) boxes[slot] = node.bounds[opened.slots[slot]];
      written.child[slot] = kNoChild;
      for (int axis = 0; axis < 3; ++axis) {
        written.bounds[axis][slot] = used ? boxes[slot].min[axis] : kNowhere;
        written.bounds[3 + axis][slot] = used ? boxes[slot].max[axis] : -kNowhere;
      }
    }
    write_order(absl::MakeSpan(boxes).subspan(0, node.child_count), written);
    return to;
  }

  uint32_t add_block(const BvhChild& leaf, const Aabbf& bounds) {
    const auto number = static_cast<uint32_t>(tree_.blocks_.size());
    TriangleBlock& block = tree_.blocks_.emplace_back();
    block = {};
    block.first = static_cast<uint32_t>(tree_.numbers_.size());
    block.count = leaf.count;
    block.extent = rounded_up_extent(bounds);
    for (uint32_t place = 0; place < kTreeWidth; ++place) {
      const Triangle& triangle = triangles_[layout_.order[leaf.first + std::min(place, leaf.count - 1)]];
      int row = 0;
      for (const Vec3f vertex : {triangle.a, triangle.b, triangle.c})
        for (int axis = 0; axis < 3; ++axis) block.vertices[row++][place] = vertex[axis];
      if (place < leaf.count) tree_.numbers_.push_back(triangle.number);
    }
    return kBlockBit | number;
  }

  const absl::Span<const Triangle> triangles_;
  const BvhLayout<float>& layout_;
  TriangleBvh& tree_;
  std::vector<Open> path_;
};

absl::StatusOr<TriangleBvh> TriangleBvh::build(absl::Span<const Triangle> triangles, const BvhOptions& options) {
  std::vector<Aabbf> boxes;
  boxes.reserve(triangles.size());
  for (const Triangle& triangle : triangles) boxes.push_back(bounds_of(triangle));
  absl::StatusOr<BvhLayout<float>> layout = build_bvh_layout<float>(boxes, options);
  if (!layout.ok()) return layout.status();
  TriangleBvh tree;
  if (triangles.empty()) return tree;
  Writer(triangles, *layout, tree).write();
  tree.bounds_ = layout->bounds;
  tree.magnitude_ = magnitude(layout->bounds);
  tree.depth_ = layout->depth;
  LOCUS_CHECK_EQ(tree.numbers_.size(), triangles.size());
  return tree;
}

Triangle TriangleBvh::at(size_t position) const {
  LOCUS_CHECK_LT(position, size());
  const auto behind = std::upper_bound(blocks_.begin(), blocks_.end(), position,
                                       [](size_t wanted, const TriangleBlock& block) { return wanted < block.first; });
  const TriangleBlock& block = *(behind - 1);
  return triangle(block, static_cast<uint32_t>(position - block.first));
}

size_t TriangleBvh::bytes() const {
  return nodes_.capacity() * sizeof(TriangleNode) + ranges_.capacity() * sizeof(NodeRange) +
         blocks_.capacity() * sizeof(TriangleBlock) + numbers_.capacity() * sizeof(uint32_t);
}

double TriangleBvh::sah_cost() const {
  if (nodes_.empty()) return 0;
  const double whole = double{half_area(bounds_)};
  double sum = 1;
  for (const TriangleNode& node : nodes_) {
    for (int slot = 0; slot < kTreeWidth; ++slot) {
      if (node.child[slot] != kNoChild) sum += whole > 0 ? double{half_area(box(node, slot))} / whole : 1;
    }
  }
  return sum;
}

Interval<float> TriangleBvh::node_interval(const SlabRay<float>& slabs, const Aabbf& box) const {
  Interval<float> result = slabs.interval(box, magnitude_);
  if (planted(PlantedBug::kUnpaddedNear))
    result.near = SlabRay<float>(Rayf{slabs.origin(), slabs.direction()}, 0).interval(box).near;
  return result;
}

TriangleBvh::Pending* TriangleBvh::push_hit(const TriangleNode& node, const SlabRay<float>& slabs, float limit,
                                            Pending* top) const {
  Pending* const base = top;
  for (int slot = 0; slot < kTreeWidth; ++slot) {
    if (node.child[slot] == kNoChild) continue;
    const Interval<float> interval = node_interval(slabs, box(node, slot));
    if (interval.near > interval.far || interval.far < 0 || beyond(interval.near, limit)) continue;
    Pending* place = top++;
    for (; place > base && place[-1].near < interval.near; --place) *place = place[-1];
    *place = {node.child[slot], interval.near};
  }
  return top;
}

}  // namespace locus
