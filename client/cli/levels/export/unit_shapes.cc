#include "client/cli/levels/export/unit_shapes.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace locus::cli {
namespace {

constexpr uint32_t kSectors = kShapeSectors;

void add_vertex(ImportedMesh& mesh, double x, double y, double z) {
  for (const double coordinate : {x, y, z}) mesh.vertices.push_back(static_cast<float>(coordinate));
}

void add_ring(ImportedMesh& mesh, double radius, double z) {
  for (uint32_t sector = 0; sector < kSectors; ++sector) {
    const double angle = 2 * std::numbers::pi * sector / kSectors;
    add_vertex(mesh, radius * std::cos(angle), radius * std::sin(angle), z);
  }
}

// Adds the band of triangles between two rings of vertices. `low` and `high` are the indices of the first vertex of
// each ring; the ring of `high` has the larger z.
void add_band(ImportedMesh& mesh, uint32_t low, uint32_t high) {
  for (uint32_t sector = 0; sector < kSectors; ++sector) {
    const uint32_t next = (sector + 1) % kSectors;
    mesh.indices.insert(mesh.indices.end(), {low + sector, low + next, high + next});
    mesh.indices.insert(mesh.indices.end(), {low + sector, high + next, high + sector});
  }
}

enum class End { kUpper, kLower };

void add_fan(ImportedMesh& mesh, uint32_t ring, uint32_t pole, End end) {
  for (uint32_t sector = 0; sector < kSectors; ++sector) {
    uint32_t a = ring + sector;
    uint32_t b = ring + (sector + 1) % kSectors;
    if (end == End::kLower) std::swap(a, b);
    mesh.indices.insert(mesh.indices.end(), {a, b, pole});
  }
}

// Adds the upper part of a unit ball: a ring of vertices for each latitude step from `lowest` on, then the pole, and
// the triangles between them. A step is 90 degrees / kSteps; step 0 is the equator.
void add_upper_part(ImportedMesh& mesh, int lowest) {
  constexpr int kSteps = kShapeSectors / 4;
  for (int step = lowest; step < kSteps; ++step) {
    const double angle = std::numbers::pi / 2 * step / kSteps;
    const auto ring = static_cast<uint32_t>(mesh.vertices.size() / 3);
    add_ring(mesh, std::cos(angle), std::sin(angle));
    if (step > lowest) add_band(mesh, ring - kSectors, ring);
  }
  const auto pole = static_cast<uint32_t>(mesh.vertices.size() / 3);
  add_vertex(mesh, 0, 0, 1);
  add_fan(mesh, pole - kSectors, pole, End::kUpper);
}

}  // namespace

ImportedMesh unit_ball() {
  ImportedMesh mesh;
  mesh.name = "ball";
  add_upper_part(mesh, 1 - kShapeSectors / 4);
  const auto pole = static_cast<uint32_t>(mesh.vertices.size() / 3);
  add_vertex(mesh, 0, 0, -1);
  add_fan(mesh, 0, pole, End::kLower);
  return mesh;
}

ImportedMesh unit_dome() {
  ImportedMesh mesh;
  mesh.name = "capsule end";
  add_upper_part(mesh, 0);
  return mesh;
}

ImportedMesh unit_tube() {
  ImportedMesh mesh;
  mesh.name = "capsule side";
  add_ring(mesh, 1, -1);
  add_ring(mesh, 1, 1);
  add_band(mesh, 0, kSectors);
  return mesh;
}

ImportedMesh unit_box() {
  ImportedMesh mesh;
  mesh.name = "box";
  // In the index of a corner, bit 0 selects the side in x, bit 1 in y, bit 2 in z.
  for (uint32_t corner = 0; corner < 8; ++corner)
    add_vertex(mesh, (corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1, (corner & 4) != 0 ? 1 : -1);
  mesh.indices = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                  2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  return mesh;
}

ImportedMesh unit_marker() {
  ImportedMesh mesh;
  mesh.name = "point";
  mesh.vertices = {1, 0, 0, 0, 1, 0, -1, 0, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1};
  mesh.indices = {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4, 1, 0, 5, 2, 1, 5, 3, 2, 5, 0, 3, 5};
  return mesh;
}

}  // namespace locus::cli
