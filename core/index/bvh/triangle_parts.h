// One node or one block of a TriangleTree, filled from boxes and triangles: for whoever makes one. Internal to this
// folder; free functions, any thread.
#ifndef LOCUS_CORE_INDEX_BVH_TRIANGLE_PARTS_H_
#define LOCUS_CORE_INDEX_BVH_TRIANGLE_PARTS_H_

#include "absl/types/span.h"
#include "core/geometry/triangle.h"
#include "core/index/bvh/triangle_tree.h"

namespace locus {

// Bounds and orders from the children's boxes, slot by slot, at most kTreeWidth; slots behind them are left empty. All
// but the numbers of the children.
void fill_boxes(absl::Span<const Aabbf> boxes, TriangleNode& node);

// From 1 to kTreeWidth triangles and the box around all of them. `first` is the position of the first.
void fill_block(absl::Span<const Triangle> triangles, const Aabbf& box, uint32_t first, TriangleBlock& block);

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_TRIANGLE_PARTS_H_
