#include "core/index/bvh/triangle_bvh.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/status_macros.h"
#include "core/index/binary_tree.h"

namespace locus {

static_assert(kTreeStack == limits::kMaxBvhDepth * (kTreeWidth - 1) + 1 + kTreeWidth);
static_assert(limits::kMaxBvhValues < kBlockBit >> 1, "kernels use two flag bits in indices of nodes and blocks");

namespace {

// Number of triangles whose BoxReference one task computes.
constexpr size_t kChunkTriangles = 1u << 14;

// Computes the BoxReference of the triangle at `index` of the input. Returns false if a vertex is not finite.
bool make_reference(const Triangle& triangle, uint32_t index, BoxReference<float>& reference) {
  const Quad<float> a = Quad<float>::of(triangle.a.x, triangle.a.y, triangle.a.z, 0);
  const Quad<float> b = Quad<float>::of(triangle.b.x, triangle.b.y, triangle.b.z, 0);
  const Quad<float> c = Quad<float>::of(triangle.c.x, triangle.c.y, triangle.c.z, 0);
  reference = BoxReference<float>::of({minimum(minimum(a, b), c), maximum(maximum(a, b), c)}, index);
  // x - x is 0 for finite x, and NaN otherwise.
  const Quad<float> difference = (a - a) + (b - b) + (c - c);
  return difference[0] + difference[1] + difference[2] == 0;
}

// Writes the BoxReference of each triangle to `references`. Errors: INVALID_ARGUMENT for the first triangle with a
// vertex that is not finite; CANCELLED if the cancel flag was set.
absl::Status make_references(absl::Span<const Triangle> triangles, const BvhOptions& options,
                             BoxReference<float>* references) {
  std::vector<size_t> bad((triangles.size() + kChunkTriangles - 1) / kChunkTriangles, triangles.size());
  for_each(options, bad.size(), [&](size_t chunk) {
    LOCUS_DCHECK_LT(chunk, bad.size());
    const size_t end = std::min(triangles.size(), (chunk + 1) * kChunkTriangles);
    for (size_t i = chunk * kChunkTriangles; i < end && !cancelled(options); ++i)
      if (!make_reference(triangles[i], static_cast<uint32_t>(i), references[i])) bad[chunk] = std::min(bad[chunk], i);
  });
  if (cancelled(options)) return cancelled_build();
  const size_t first = *std::min_element(bad.begin(), bad.end());
  return first == triangles.size() ? absl::OkStatus() : refuse_bounds(first);
}

}  // namespace

absl::StatusOr<TriangleBvh> TriangleBvh::build(absl::Span<const Triangle> triangles, const BvhOptions& options) {
  RETURN_IF_ERROR(check_build(triangles.size(), options));
  TriangleBvh built;
  if (triangles.empty()) return built;
  auto references = std::make_unique_for_overwrite<BoxReference<float>[]>(triangles.size());
  RETURN_IF_ERROR(make_references(triangles, options, references.get()));
  const auto count = static_cast<uint32_t>(triangles.size());
  ASSIGN_OR_RETURN(BinaryTree<float> tree, BinaryTree<float>::build(std::move(references), count, options));
  built.arrays_ = TriangleWriter(triangles, tree, options).write();
  if (cancelled(options)) return cancelled_build();
  built.set_bounds(tree.root().bounds);
  LOCUS_DCHECK_CALL(built.check_invariants());
  LOCUS_CHECK_EQ(built.size(), triangles.size());
  LOCUS_CHECK_LE(built.depth(), limits::kMaxBvhDepth);
  return built;
}

absl::StatusOr<TriangleBvh> TriangleBvh::restore(const TreeTopology& topology, uint32_t triangle_count,
                                                 absl::FunctionRef<Triangle(uint32_t)> triangle,
                                                 const BvhOptions& options) {
  ASSIGN_OR_RETURN(TriangleArrays arrays, restore_arrays(topology, triangle_count, triangle, options));
  TriangleBvh restored;
  restored.arrays_ = std::move(arrays);
  const TriangleNode& root = restored.arrays_.nodes[0];
  Aabbf bounds;
  for (int slot = 0; slot < kTreeWidth && root.child[slot] != kNoChild; ++slot) bounds = merge(bounds, box(root, slot));
  restored.set_bounds(bounds);
  LOCUS_DCHECK_CALL(restored.check_invariants());
  return restored;
}

void TriangleBvh::set_bounds(const Aabbf& bounds) {
  bounds_ = bounds;
  magnitude_ = magnitude(bounds);
  const Vec3d extent = to_double(bounds.max) - to_double(bounds.min);
  // The probability that a random line through the bounds, parallel to an axis, intersects a box is the ratio of the
  // cross section of the box to that of the bounds.
  Vec3d boxes_met;
  for (const TriangleNode& node : nodes()) {
    for (int slot = 0; slot < kTreeWidth && node.child[slot] != kNoChild; ++slot) {
      const Aabbf child = box(node, slot);
      const Vec3d size = to_double(child.max) - to_double(child.min);
      for (int axis = 0; axis < 3; ++axis) boxes_met[axis] += size[(axis + 1) % 3] * size[(axis + 2) % 3];
    }
  }
  for (int axis = 0; axis < 3; ++axis) boxes_a_unit_[axis] = boxes_met[axis] / (extent.x * extent.y * extent.z);
}

HalfLine TriangleBvh::cheapest_half_line(const Vec3d& point) const {
  HalfLine best;
  double least = std::numeric_limits<double>::infinity();
  for (const bool descending : {false, true}) {
    for (int axis = 0; axis < 3; ++axis) {
      const double length =
          descending ? point[axis] - double{bounds_.min[axis]} : double{bounds_.max[axis]} - point[axis];
      const double boxes = length * boxes_a_unit_[axis];
      if (boxes >= least) continue;
      least = boxes;
      best = {axis, descending};
    }
  }
  return best;
}

void TriangleBvh::check_invariants() const {
  LOCUS_DCHECK_LE(depth(), limits::kMaxBvhDepth);
  std::vector<uint32_t> pending = {0};
  uint32_t next_node = 0, next_block = 0, next_position = 0;
  while (!pending.empty()) {
    const uint32_t index = pending.back();
    pending.pop_back();
    LOCUS_DCHECK_EQ(index, next_node);
    ++next_node;
    LOCUS_DCHECK_EQ(arrays_.ranges[index].first, next_position);
    LOCUS_DCHECK_CALL(check_node(index));
    const absl::Span<const uint32_t> children(arrays_.nodes[index].child);
    for (const uint32_t child : children) {
      if (child == kNoChild || (child & kBlockBit) == 0) continue;
      LOCUS_DCHECK_EQ(child & ~kBlockBit, next_block);
      ++next_block;
      LOCUS_DCHECK_EQ(arrays_.blocks[child & ~kBlockBit].first, next_position);
      next_position += arrays_.blocks[child & ~kBlockBit].count;
    }
    for (size_t slot = children.size(); slot-- > 0;)
      if ((children[slot] & kBlockBit) == 0) pending.push_back(children[slot]);
  }
  LOCUS_DCHECK_EQ(next_node, arrays_.node_count);
  LOCUS_DCHECK_EQ(next_block, arrays_.block_count);
  LOCUS_DCHECK_EQ(next_position, arrays_.triangle_count);
}

// Verifies one node: its used slots are contiguous, each of its orders contains every slot once, its boxes contain the
// boxes or triangles below them, and the length of its range is the number of triangles below it.
void TriangleBvh::check_node(uint32_t index) const {
  const TriangleNode& node = arrays_.nodes[index];
  uint32_t count = 0;
  for (int slot = 0; slot < kTreeWidth; ++slot) {
    const uint32_t child = node.child[slot];
    LOCUS_DCHECK(child == kNoChild || slot == 0 || node.child[slot - 1] != kNoChild);
    uint32_t slots_in_order = 0;
    for (int rank = 0; rank < kTreeWidth; ++rank) slots_in_order |= 1u << (node.order[slot] >> (3 * rank) & 7u);
    LOCUS_DCHECK_EQ(slots_in_order, 0xFFu);
    if (child == kNoChild) continue;
    if ((child & kBlockBit) == 0) {
      const TriangleNode& below = arrays_.nodes[child];
      for (int i = 0; i < kTreeWidth && below.child[i] != kNoChild; ++i)
        LOCUS_DCHECK(contains(box(node, slot), box(below, i)));
      count += arrays_.ranges[child].count;
    } else {
      const TriangleBlock& block = arrays_.blocks[child & ~kBlockBit];
      LOCUS_DCHECK(0 < block.count && block.count <= kTreeWidth);
      for (uint32_t lane = 0; lane < block.count; ++lane)
        LOCUS_DCHECK(contains(box(node, slot), bounds_of(triangle(block, lane))));
      count += block.count;
    }
  }
  LOCUS_DCHECK_LT(0u, count);
  LOCUS_DCHECK_EQ(count, arrays_.ranges[index].count);
}

Triangle TriangleBvh::at(size_t position) const {
  LOCUS_CHECK_LT(position, size());
  const auto next = std::upper_bound(blocks().begin(), blocks().end(), position,
                                     [](size_t wanted, const TriangleBlock& block) { return wanted < block.first; });
  const TriangleBlock& block = *(next - 1);
  return triangle(block, static_cast<uint32_t>(position - block.first));
}

size_t TriangleBvh::bytes() const {
  return node_count() * (sizeof(TriangleNode) + sizeof(NodeRange)) + blocks().size() * sizeof(TriangleBlock) +
         size() * sizeof(uint32_t);
}

double TriangleBvh::sah_cost() const {
  if (size() == 0) return 0;
  const double root_area = double{half_area(bounds_)};
  double sum = 1;
  for (const TriangleNode& node : nodes()) {
    for (int slot = 0; slot < kTreeWidth; ++slot) {
      if (node.child[slot] != kNoChild) sum += root_area > 0 ? double{half_area(box(node, slot))} / root_area : 1;
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

TriangleBvh::Pending* TriangleBvh::push_near(const TriangleNode& node, const float (&distances)[kTreeWidth],
                                             float limit, Pending* top) {
  Pending* const base = top;
  for (int slot = 0; slot < kTreeWidth; ++slot) {
    if (distances[slot] > limit || node.child[slot] == kNoChild) continue;
    Pending* position = top++;
    for (; position > base && position[-1].near < distances[slot]; --position) *position = position[-1];
    *position = {node.child[slot], distances[slot]};
  }
  return top;
}

TriangleBvh::Pending* TriangleBvh::push_hit(const TriangleNode& node, const SlabRay<float>& slabs, float limit,
                                            Pending* top) const {
  Pending* const base = top;
  for (int slot = 0; slot < kTreeWidth; ++slot) {
    if (node.child[slot] == kNoChild) continue;
    const Interval<float> interval = node_interval(slabs, box(node, slot));
    if (interval.near > interval.far || interval.far < 0 || beyond(interval.near, limit)) continue;
    Pending* position = top++;
    for (; position > base && position[-1].near < interval.near; --position) *position = position[-1];
    *position = {node.child[slot], interval.near};
  }
  return top;
}

}  // namespace locus
