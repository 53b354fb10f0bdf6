#include "client/cli/levels/generate/city.h"

#include <algorithm>
#include <array>
#include <vector>

#include "client/cli/levels/generate/splitmix64.h"

namespace locus::cli {
namespace {

constexpr uint64_t kBoxTriangles = 12;

// All lengths are integers in half metres, so that every coordinate is a multiple of 0.5 m and exact in float.
constexpr int64_t kLotPitch = 48;      // distance from a lot to the next: lot and street
constexpr int64_t kMinWidth = 10;      // minimum width of a building
constexpr int64_t kWidthChoices = 27;  // number of possible widths; the widest building leaves a street of 12 (6 m)
constexpr int64_t kMinHeight = 6;      // minimum height of a step (a box of a building)
constexpr int64_t kHeightChoices = 55;
constexpr int64_t kGroundDepth = 4;
constexpr int64_t kMaxSteps = 4;

struct Box {
  std::array<int64_t, 3> min, max;
};

void append_box(const Box& box, ImportedMesh& mesh) {
  // In the index of a corner, bit 0 selects the side in x, bit 1 in y, bit 2 in z.
  constexpr std::array<uint8_t, 36> kCorners = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                                2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  const auto first = static_cast<uint32_t>(mesh.vertices.size() / 3);
  for (uint32_t corner = 0; corner < 8; ++corner) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const int64_t half_metres = (corner >> axis & 1) != 0 ? box.max[axis] : box.min[axis];
      mesh.vertices.push_back(static_cast<float>(half_metres) * 0.5f);
    }
  }
  for (uint8_t corner : kCorners) mesh.indices.push_back(first + corner);
}

// Returns the number of boxes on each lot. The sum over all lots is `boxes`.
std::vector<uint8_t> plan_lots(uint64_t boxes, SplitMix64& random) {
  std::vector<uint8_t> lots;
  while (boxes > 0) {
    const bool is_tower = random.below(3) == 0;
    const uint64_t steps = is_tower ? 2 + random.below(kMaxSteps - 1) : 1;
    lots.push_back(static_cast<uint8_t>(std::min(steps, boxes)));
    boxes -= lots.back();
  }
  return lots;
}

// Appends a building of `steps` boxes, one on top of the other, to the lot with minimum corner `lot`. Each box is
// narrower on all sides than the box below it.
void append_building(std::array<int64_t, 2> lot, uint8_t steps, SplitMix64& random, ImportedMesh& mesh) {
  Box box;
  for (size_t axis = 0; axis < 2; ++axis) {
    const int64_t width = kMinWidth + random.below(kWidthChoices);
    box.min[axis] = lot[axis] + random.below(static_cast<uint32_t>(kMinWidth + kWidthChoices - width));
    box.max[axis] = box.min[axis] + width;
  }
  box.max[2] = 0;
  for (uint8_t step = 0; step < steps; ++step) {
    if (step > 0) {
      for (size_t axis = 0; axis < 2; ++axis) {
        ++box.min[axis];
        --box.max[axis];
      }
    }
    box.min[2] = box.max[2];
    box.max[2] += kMinHeight + random.below(kHeightChoices);
    append_box(box, mesh);
  }
}

int64_t square_side(size_t lots) {
  int64_t side = 1;
  while (static_cast<size_t>(side * side) < lots) ++side;
  return side;
}

}  // namespace

ImportedMesh generate_city(uint64_t triangles, uint64_t seed) {
  const uint64_t boxes = std::max<uint64_t>(std::min(triangles, kMaxCityTriangles) / kBoxTriangles, 1);
  SplitMix64 random(seed);
  const std::vector<uint8_t> lots = plan_lots(boxes - 1, random);
  const int64_t side = square_side(lots.size());
  const int64_t half = side * kLotPitch / 2;

  ImportedMesh mesh;
  mesh.name = "city";
  mesh.vertices.reserve(boxes * 24);
  mesh.indices.reserve(boxes * 36);
  mesh.parts.push_back({"ground", 0});
  append_box({{-half, -half, -kGroundDepth}, {half, half, 0}}, mesh);
  if (!lots.empty()) mesh.parts.push_back({"buildings", static_cast<uint32_t>(kBoxTriangles)});
  for (size_t i = 0; i < lots.size(); ++i) {
    const auto index = static_cast<int64_t>(i);
    append_building({index % side * kLotPitch - half, index / side * kLotPitch - half}, lots[i], random, mesh);
  }
  return mesh;
}

}  // namespace locus::cli
