// Test rays aimed at edges shared by two triangles. Because of rounding errors, a fast intersection test can miss both
// triangles at such an edge. Seen from the origin of a ray, the two triangles lie on different sides of the edge, so
// the ray must hit one of them.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_DEMO_EDGE_RAYS_H_
#define LOCUS_CLIENT_CLI_EXTRAS_DEMO_EDGE_RAYS_H_

#include <cstdint>
#include <vector>

#include "core/geometry/triangle.h"

namespace locus::cli {

// Rays as interleaved x, y, z in mesh axes. A ray reaches its target on the edge at t = 1, so it must have a hit at t
// <= 1 + kEdgeAllowance.
struct EdgeRays {
  std::vector<float> origins;
  std::vector<float> directions;

  size_t size() const { return origins.size() / 3; }
};

// Tolerance in t, because the target is rounded to float. It is large enough for the flattest angle of incidence that
// aim_at_edges() chooses.
inline constexpr float kEdgeAllowance = 1e-3f;

// Returns `count` rays, distributed evenly over all edges that are shared by exactly two triangles, neither of which is
// a sliver. Returns fewer than `count` rays only if hardly any edge is suitable.
EdgeRays aim_at_edges(const std::vector<Triangle>& triangles, size_t count, uint64_t seed);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_DEMO_EDGE_RAYS_H_
