#include "client/cli/levels/generate/blob.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "client/cli/levels/generate/gradient_noise.h"
#include "client/cli/levels/generate/whole_root.h"

namespace locus::cli {
namespace {

constexpr double kRadius = (kMinBlobRadius + kMaxBlobRadius) * 0.5;
constexpr double kDent = (kMaxBlobRadius - kMinBlobRadius) * 0.5;
constexpr double kDentDistance = 0.5;  // wavelength of the noise, relative to the radius
constexpr int kOctaves = 4;

// Vertex numbering of an octahedron whose edges are divided into f = `frequency` segments. The vertices are the integer
// points with |x| + |y| + |z| = f, numbered ring by ring from z = -f to z = f. The ring at height z has 4 k points with
// k = f - |z|, counter-clockwise from +x. The two poles are rings of one point.
class Octahedron {
 public:
  explicit Octahedron(int64_t frequency) : f_(frequency) {}

  int64_t frequency() const { return f_; }
  int64_t ring_size(int64_t z) const { return std::max<int64_t>(4 * (f_ - std::abs(z)), 1); }

  // Returns the index of the vertex that is `step` steps along side `side` (0 .. 3) of the ring at height z. The last
  // vertex of a side is the first vertex of the next side.
  uint32_t vertex(int64_t z, int64_t side, int64_t step) const {
    const int64_t k = f_ - std::abs(z);
    return static_cast<uint32_t>(first_of_ring(z) + (k == 0 ? 0 : (side * k + step) % (4 * k)));
  }

 private:
  int64_t first_of_ring(int64_t z) const {
    const int64_t below = z + f_;  // number of rings below this one
    if (below == 0) return 0;
    if (z <= 0) return 1 + 2 * below * (below - 1);
    const int64_t above = f_ - z;  // number of rings above this one
    return 4 * f_ * f_ + 2 - (above == 0 ? 1 : 1 + 2 * above * (above + 1));
  }

  int64_t f_;
};

std::array<int64_t, 2> point_of_ring(int64_t k, int64_t position) {
  if (k == 0) return {0, 0};
  const int64_t step = position % k;
  switch (position / k) {
    case 0:
      return {k - step, step};
    case 1:
      return {-step, k - step};
    case 2:
      return {step - k, -step};
    default:
      return {step, step - k};
  }
}

void append_vertex(const std::array<double, 3>& lattice, uint64_t seed, ImportedMesh& mesh) {
  const double length = std::sqrt(lattice[0] * lattice[0] + lattice[1] * lattice[1] + lattice[2] * lattice[2]);
  const std::array<double, 3> direction = {lattice[0] / length, lattice[1] / length, lattice[2] / length};
  const double radius = kRadius + kDent * fractal_noise(direction, kDentDistance, kOctaves, seed);
  for (const double part : direction) mesh.vertices.push_back(static_cast<float>(part * radius));
}

// Appends the strip of triangles between side `side` of the ring at height z and the same side of the ring at z + 1.
void append_strip(const Octahedron& octahedron, int64_t z, int64_t side, ImportedMesh& mesh) {
  const int64_t low = octahedron.frequency() - std::abs(z);
  const int64_t high = octahedron.frequency() - std::abs(z + 1);
  const auto append = [&](uint32_t a, uint32_t b, uint32_t c) { mesh.indices.insert(mesh.indices.end(), {a, b, c}); };
  const auto lower = [&](int64_t step) { return octahedron.vertex(z, side, step); };
  const auto upper = [&](int64_t step) { return octahedron.vertex(z + 1, side, step); };
  for (int64_t step = 0; step < std::max(low, high); ++step) {
    if (low > high) {
      append(lower(step), lower(step + 1), upper(step));
      if (step + 1 < low) append(lower(step + 1), upper(step + 1), upper(step));
    } else {
      append(lower(step), upper(step + 1), upper(step));
      if (step + 1 < high) append(lower(step), lower(step + 1), upper(step + 1));
    }
  }
}

}  // namespace

ImportedMesh generate_blob(uint64_t triangles, uint64_t seed) {
  const Octahedron octahedron(
      static_cast<int64_t>(whole_root(std::clamp(triangles, kMinBlobTriangles, kMaxBlobTriangles) / 8)));
  const int64_t f = octahedron.frequency();
  ImportedMesh mesh;
  mesh.name = "blob";
  mesh.parts.push_back({"blob", 0});
  mesh.vertices.reserve(static_cast<size_t>(4 * f * f + 2) * 3);
  mesh.indices.reserve(static_cast<size_t>(8 * f * f) * 3);
  for (int64_t z = -f; z <= f; ++z) {
    for (int64_t position = 0; position < octahedron.ring_size(z); ++position) {
      const auto [x, y] = point_of_ring(f - std::abs(z), position);
      append_vertex({static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)}, seed, mesh);
    }
  }
  for (int64_t z = -f; z < f; ++z)
    for (int64_t side = 0; side < 4; ++side) append_strip(octahedron, z, side, mesh);
  return mesh;
}

}  // namespace locus::cli
