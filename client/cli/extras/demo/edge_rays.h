// Rays aimed at the edges that two triangles share, where fast intersectors leak: from in front of the edge, so that no
// ray may pass it.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_DEMO_EDGE_RAYS_H_
#define LOCUS_CLIENT_CLI_EXTRAS_DEMO_EDGE_RAYS_H_

#include <cstdint>
#include <vector>

#include "core/geometry/triangle.h"

namespace locus::cli {

// Interleaved x, y, z in mesh axes. The target is at t = 1: a hit with t <= 1 + kEdgeAllowance is wanted for every ray.
struct EdgeRays {
  std::vector<float> origins;
  std::vector<float> directions;

  size_t size() const { return origins.size() / 3; }
};

// Covers rounding of the target to float, seen at the flattest angle that is aimed.
inline constexpr float kEdgeAllowance = 1e-3f;

// `count` rays over all edges shared by exactly two triangles that are not slivers, in turn; fewer only if there is no
// such edge.
EdgeRays aim_at_edges(const std::vector<Triangle>& triangles, size_t count, uint64_t seed);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_DEMO_EDGE_RAYS_H_
