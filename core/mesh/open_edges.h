// Counts the open edges of a mesh. A mesh without open edges is closed, and therefore has an inside.
#ifndef LOCUS_CORE_MESH_OPEN_EDGES_H_
#define LOCUS_CORE_MESH_OPEN_EDGES_H_

#include <cstdint>

#include "absl/types/span.h"

namespace locus {

// Returns the number of open edges. An edge is a pair of corners with different coordinates. For each edge, compares
// the number of triangles that use the edge in one direction with the number of triangles that use it in the other
// direction. The result is the sum of the absolute differences over all edges. Corners with equal coordinates are the
// same corner, even if their indices differ; -0 equals 0. `vertices` has 3 coordinates for each vertex, and `indices`
// has 3 valid vertex indices for each triangle. O(n) if triangles share vertices by index, otherwise O(n log n). Needs
// at most about 40 bytes of memory for each triangle, or 130 bytes if no triangles share a vertex.
uint64_t count_open_edges(absl::Span<const float> vertices, absl::Span<const uint32_t> indices);

}  // namespace locus

#endif  // LOCUS_CORE_MESH_OPEN_EDGES_H_
