// The things (objects and instances) of a dumped scene, one by one, and as rows. For the dump and export commands.
// Plain data and functions without state.
#ifndef LOCUS_CLIENT_CLI_ROWS_SCENE_ROWS_H_
#define LOCUS_CLIENT_CLI_ROWS_SCENE_ROWS_H_

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/cli/output.h"
#include "client/lib/client.h"

namespace locus::cli {

enum class ThingKind { kPoint, kBall, kBox, kCapsule, kInstance };

// Object or instance of a scene.
struct SceneThing {
  ThingKind kind = ThingKind::kPoint;
  uint64_t id = 0;
  std::array<double, 3> at{};
  std::array<float, 4> rotation{0, 0, 0, 1};  // x, y, z, w
  float radius = 0;                           // ball, capsule
  std::array<float, 3> size{};                // box: half extents; capsule: half axis
  std::string mesh;                           // instance
  float scale = 1;                            // instance
  uint32_t layers = 1;
  uint64_t group = 0;
  uint64_t tag = 0;
};

// Returns "point", "ball", "box" or "capsule"; empty for an instance.
std::string shape_name(ThingKind kind);

// Calls `take` with each thing of a message of a dump, objects before instances, until it fails. DATA_LOSS if a column
// does not have one entry per id.
absl::Status for_each_thing(const v1::DumpSceneResponse& message,
                            const std::function<absl::Status(const SceneThing&)>& take);

// Choice of the things that a command reads.
enum class Things { kAll, kObjects, kInstances };
bool is_among(Things things, ThingKind kind);

// Returns the keys of rows, in order: id, shape or mesh, at, rotation, scale, radius, half, axis, layers, group, tag.
// They have the names of the insert command's options where it has them, so that rows of objects can be inserted. Rows
// of both kinds of things begin with kind: "object" or "instance".
const std::vector<std::string>& thing_keys(Things things);

// Returns the row of a thing, without the keys that its kind does not have.
Json thing_row(const SceneThing& thing, Things things);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_SCENE_ROWS_H_
