// The boxes and queries of the suite structures. A scene, a count and fixed seeds determine them. Density does not
// depend on the count, so that the work of a query grows only by what a structure costs. Plain data and pure functions.
#ifndef LOCUS_TESTS_BENCH_STRUCTURES_SCENES_H_
#define LOCUS_TESTS_BENCH_STRUCTURES_SCENES_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/scene/objects/object.h"

namespace locus::bench::structures {

// kUniform: boxes of 1 m, on average one per cube of 4 m. kHub: every second box of a uniform scene is in a cube with a
// twentieth of its side. kCity1: blocks of up to 3 m on a square grid of 1 m. kCity100: the same, a hundred times as
// large. kGiant: uniform, and the first box is as large as the scene.
enum class SceneKind : uint8_t { kUniform, kHub, kCity1, kCity100, kGiant };
inline constexpr std::array<SceneKind, 5> kScenes = {SceneKind::kUniform, SceneKind::kHub, SceneKind::kCity1,
                                                     SceneKind::kCity100, SceneKind::kGiant};
const char* name_of(SceneKind kind);

struct Scene {
  std::vector<Object> boxes;
  double spacing = 1;  // mean distance between neighbours in metres, outside of the hub
};
Scene scene_of(SceneKind kind, uint32_t count);

struct SceneQueries {
  double short_length = 1;      // length of the short rays: two spacings
  std::vector<ObjectRay> rays;  // unit directions, without end, from near a random box
  std::vector<Balld> balls;     // radius: one spacing
  std::vector<Obbd> boxes;      // half extents: one spacing
  std::vector<Vec3d> points;
};
SceneQueries queries_of(const Scene& scene, size_t count);

}  // namespace locus::bench::structures

#endif  // LOCUS_TESTS_BENCH_STRUCTURES_SCENES_H_
