// Meshes that resemble real ones, made from a seed: a closed bumpy sphere and a city of boxes. The number of a triangle
// is its index in the returned vector.
#ifndef LOCUS_TESTS_SUPPORT_GENERATED_MESHES_H_
#define LOCUS_TESTS_SUPPORT_GENERATED_MESHES_H_

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/support/scene_sketch.h"

namespace locus::test {

inline void number_in_order(std::vector<Triangle>& triangles) {
  for (size_t i = 0; i < triangles.size(); ++i) triangles[i].number = static_cast<uint32_t>(i);
}

// Returns a closed mesh around the origin, such that every ray from the origin hits it. The distances of the vertices
// from the origin are 1 plus or minus `noise`. The mesh has 4 * rings * (rings - 1) triangles; neighbouring triangles
// have bitwise equal vertices.
inline std::vector<Triangle> bumpy_sphere(int rings, double noise, uint64_t seed) {
  Random random(seed);
  const int sectors = 2 * rings;
  std::vector<Vec3f> vertices;
  for (int ring = 0; ring <= rings; ++ring) {
    const double polar = std::numbers::pi * ring / rings;
    const bool pole = ring == 0 || ring == rings;
    for (int sector = 0; sector < sectors; ++sector) {
      const double around = 2 * std::numbers::pi * sector / sectors;
      const double radius = pole ? 1 : 1 + random.between(-noise, noise);
      const Vec3d unit = {pole ? 0 : std::sin(polar) * std::cos(around), pole ? 0 : std::sin(polar) * std::sin(around),
                          std::cos(polar)};
      vertices.push_back(to_float(unit * radius));
    }
  }
  const auto vertex = [&](int ring, int sector) {
    return vertices[static_cast<size_t>(ring * sectors + sector % sectors)];
  };
  std::vector<Triangle> triangles;
  for (int ring = 0; ring < rings; ++ring) {
    for (int sector = 0; sector < sectors; ++sector) {
      const Vec3f a = vertex(ring, sector), b = vertex(ring + 1, sector);
      const Vec3f c = vertex(ring + 1, sector + 1), d = vertex(ring, sector + 1);
      if (ring + 1 < rings) triangles.push_back({a, b, c});
      if (ring > 0) triangles.push_back({a, c, d});
    }
  }
  number_in_order(triangles);
  return triangles;
}

// Returns houses of 12 triangles on a square lattice of `side` * `side` plots of 10 units, with corners on half units.
inline std::vector<Triangle> box_city(int side, uint64_t seed) {
  Random random(seed);
  std::vector<Triangle> triangles;
  for (int plot = 0; plot < side * side; ++plot) {
    const Vec3d half = {random.whole(2, 9) * 0.5, random.whole(2, 9) * 0.5, random.whole(4, 40) * 0.5};
    const Placement house{{10.0 * (plot % side), 10.0 * (plot / side), half.z}, half, {}};
    internal::append_closed_box(triangles, house);
  }
  number_in_order(triangles);
  return triangles;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_GENERATED_MESHES_H_
