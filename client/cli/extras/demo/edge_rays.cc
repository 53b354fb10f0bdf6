#include "client/cli/extras/demo/edge_rays.h"

#include <array>
#include <map>
#include <optional>
#include <utility>

#include "client/cli/extras/demo/demo_random.h"

namespace locus::cli {
namespace {

using Corner = std::array<float, 3>;

Corner key_of(Vec3f v) { return {v.x, v.y, v.z}; }

// Edge of a mesh, and the third vertex of each triangle that has this edge.
struct Edge {
  Vec3f from, to;
  std::vector<Vec3f> opposite;
};

std::vector<Edge> shared_edges(const std::vector<Triangle>& triangles) {
  std::map<std::pair<Corner, Corner>, Edge> edges;
  for (const Triangle& triangle : triangles) {
    const std::array<Vec3f, 3> v = {triangle.a, triangle.b, triangle.c};
    for (size_t k = 0; k < 3; ++k) {
      const Vec3f from = v[k], to = v[(k + 1) % 3];
      Edge& edge = edges[std::minmax(key_of(from), key_of(to))];
      edge.from = from;
      edge.to = to;
      edge.opposite.push_back(v[(k + 2) % 3]);
    }
  }
  std::vector<Edge> shared;
  for (auto& [key, edge] : edges)
    if (edge.opposite.size() == 2) shared.push_back(std::move(edge));
  return shared;
}

// Returns the unit vector that is perpendicular to the edge and points towards `point`. Returns nullopt if the triangle
// of the edge and `point` is a sliver, or if the edge is too short.
std::optional<Vec3d> across(const Edge& edge, Vec3f point) {
  const Vec3d along = to_double(edge.to) - to_double(edge.from);
  const Vec3d to_point = to_double(point) - to_double(edge.from);
  const double length = std::sqrt(squared_length(along));
  // Refuse an edge whose length is near the rounding error of a ray's coordinates.
  if (length <= 1e-5 * max_component(abs(to_double(edge.from)))) return std::nullopt;
  const Vec3d unit = along * (1 / length);
  const Vec3d rest = to_point - unit * dot(to_point, unit);
  const double height = std::sqrt(squared_length(rest));
  if (height < 0.02 * length) return std::nullopt;
  return rest * (1 / height);
}

struct Aim {
  Vec3d target;
  Vec3d away;  // offset of the ray's origin from the target
};

// Chooses a target on the edge, and an origin for a ray to this target. Seen from the origin, the two triangles at the
// edge lie on different sides of the edge. Returns nullopt if the edge is unsuitable, or if from the chosen origin the
// triangles lie on the same side or a triangle is nearly edge-on.
std::optional<Aim> aim(const Edge& edge, DemoRandom& random) {
  const std::optional<Vec3d> left = across(edge, edge.opposite[0]);
  const std::optional<Vec3d> right = across(edge, edge.opposite[1]);
  if (!left || !right) return std::nullopt;
  const Vec3d along = to_double(edge.to) - to_double(edge.from);
  const double length = std::sqrt(squared_length(along));
  const Vec3d side = cross(along * (1 / length), *left);
  const Vec3d other = cross(*right, along * (1 / length));
  Vec3d away = side + other;
  if (squared_length(away) < 0.5) return std::nullopt;  // the fold is too sharp: the normals are almost opposite
  const double sideways = 0.4 * random.sign(), lengthways = 0.3 * random.sign() / length;
  const Vec3d jitter = *left * sideways + along * lengthways;
  away = normalized(away) + jitter;
  if (random.unit() < 0.5f) away = -away;
  // Require that, seen from the origin, the two triangles lie on different sides of the edge and neither is nearly
  // edge-on (parallel to the ray).
  const Vec3d front = cross(along * (1 / length), normalized(away));
  if (!(dot(front, *left) * dot(front, *right) < -0.05)) return std::nullopt;
  const double weight = 0.02 + 0.96 * random.unit();  // keeps the target away from the edge's end points
  return Aim{to_double(edge.from) + along * weight, away * (length * (0.1 + 2 * random.unit()))};
}

void append(std::vector<float>& column, Vec3f v) { column.insert(column.end(), {v.x, v.y, v.z}); }

}  // namespace

EdgeRays aim_at_edges(const std::vector<Triangle>& triangles, size_t count, uint64_t seed) {
  EdgeRays rays;
  const std::vector<Edge> edges = shared_edges(triangles);
  DemoRandom random(seed);
  // Limit the number of attempts, since the loop would not end for a mesh of slivers only.
  const size_t tries = 20 * count;
  for (size_t i = 0; !edges.empty() && i < tries && rays.size() < count; ++i) {
    const std::optional<Aim> aimed = aim(edges[i % edges.size()], random);
    if (!aimed) continue;
    const Vec3f origin = to_float(aimed->target + aimed->away);
    const Vec3f direction = to_float(aimed->target - to_double(origin));
    if (direction == Vec3f{}) continue;
    append(rays.origins, origin);
    append(rays.directions, direction);
  }
  return rays;
}

}  // namespace locus::cli
