// Functions that fill one node or one block of a TriangleTree from boxes or triangles; used by the build and by the
// restore of a tree. Internal to this folder. Free functions, any thread.
#ifndef LOCUS_CORE_INDEX_BVH_TRIANGLE_PARTS_H_
#define LOCUS_CORE_INDEX_BVH_TRIANGLE_PARTS_H_

#include "absl/types/span.h"
#include "core/geometry/triangle.h"
#include "core/index/bvh/triangle_tree.h"

namespace locus {

// Sets `bounds` and `order` of a node; boxes[i] is the box of the child in slot i. Precondition: 1 to kTreeWidth boxes.
// Slots without a box get a box that no test hits. Leaves `child` unchanged.
void fill_boxes(absl::Span<const Aabbf> boxes, TriangleNode& node);

// Sets all members of a block from 1 to kTreeWidth triangles and the box around them. `first` is the storage position
// of the first triangle.
void fill_block(absl::Span<const Triangle> triangles, const Aabbf& box, uint32_t first, TriangleBlock& block);

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_BVH_TRIANGLE_PARTS_H_
