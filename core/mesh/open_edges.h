// Number of open edges of a mesh. A mesh is closed, so that it has an inside, if it has none.
#ifndef LOCUS_CORE_MESH_OPEN_EDGES_H_
#define LOCUS_CORE_MESH_OPEN_EDGES_H_

#include <cstdint>

#include "absl/types/span.h"

namespace locus {

// Returns by how much the uses of edges differ: for each edge, a pair of corners with different coordinates, the
// difference between the number of triangles that use it in one direction and in the other one, summed over all edges.
// Corners with equal coordinates are one corner, whatever their indices; -0 equals 0. `vertices` has 3 coordinates for
// each vertex, `indices` 3 valid vertex indices for each triangle. O(n) if triangles share vertices by index, otherwise
// O(n log n); at most about 40 bytes of memory for each triangle, 130 if none shares a vertex.
uint64_t count_open_edges(absl::Span<const float> vertices, absl::Span<const uint32_t> indices);

}  // namespace locus

#endif  // LOCUS_CORE_MESH_OPEN_EDGES_H_
