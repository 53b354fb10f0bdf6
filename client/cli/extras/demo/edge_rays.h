// Test rays aimed at edges shared by two triangles, where fast intersectors can miss both. The origins lie in front of
// the edge, so that every ray must hit one of its triangles.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_DEMO_EDGE_RAYS_H_
#define LOCUS_CLIENT_CLI_EXTRAS_DEMO_EDGE_RAYS_H_

#include <cstdint>
#include <vector>

#include "core/geometry/triangle.h"

namespace locus::cli {

// Rays as interleaved x, y, z in mesh axes. The target point on the edge is at t = 1: every ray must have a hit with t
// <= 1 + kEdgeAllowance.
struct EdgeRays {
  std::vector<float> origins;
  std::vector<float> directions;

  size_t size() const { return origins.size() / 3; }
};

// Tolerance in t for rounding of the target to float, at the flattest angle of incidence that aim_at_edges() uses.
inline constexpr float kEdgeAllowance = 1e-3f;

// Returns `count` rays, distributed in turn over all edges shared by exactly two triangles that are not slivers.
// Returns fewer only if hardly any edge qualifies.
EdgeRays aim_at_edges(const std::vector<Triangle>& triangles, size_t count, uint64_t seed);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_DEMO_EDGE_RAYS_H_
