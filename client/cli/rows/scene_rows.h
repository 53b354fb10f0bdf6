// Functions that iterate over the objects and instances ("things") of a dumped scene and convert them to rows of a
// report. For the dump and export commands. Plain data and functions without state.
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

enum class ThingKind { kPoint, kBall, kBox, kCapsule, kCompound, kInstance };

// Object or instance of a scene. Fields that do not apply to its kind have their defaults.
struct SceneThing {
  ThingKind kind = ThingKind::kPoint;
  uint64_t id = 0;
  std::array<double, 3> at{};
  std::array<float, 4> rotation{0, 0, 0, 1};  // x, y, z, w
  float radius = 0;                           // ball, capsule
  std::array<float, 3> size{};                // box: half extents; capsule: half axis
  std::string mesh;                           // instance
  float scale = 1;                            // instance
  const v1::Compound* compound = nullptr;     // compound: its parts, in the message of the dump
  uint32_t layers = 1;
  uint64_t group = 0;
  uint64_t tag = 0;
};

// Returns the name of an object's shape: "point", "ball", "box", "capsule" or "compound". Returns an empty string for
// an instance.
std::string shape_name(ThingKind kind);

// Calls `take` for each thing in one message of a dump, objects before instances. Stops at the first error of `take`
// and returns it. Returns DATA_LOSS if a column does not have one entry per id.
absl::Status for_each_thing(const v1::DumpSceneResponse& message,
                            const std::function<absl::Status(const SceneThing&)>& take);

// Choice of the things that a command reads: all, only objects or only instances.
enum class Things { kAll, kObjects, kInstances };
bool is_among(Things things, ThingKind kind);

// Returns the keys of thing_row(), in order: id, shape or mesh, at, rotation, scale, radius, half, axis, parts,
// layers, group, tag. The keys equal the names of the options of the insert command, so that dumped rows of objects can
// be inserted again. With Things::kAll, these keys are preceded by kind, whose value is "object" or "instance".
const std::vector<std::string>& thing_keys(Things things);

// Returns `thing` as a row of a report. `things` is the choice for the whole report; with kAll the row begins with the
// key kind. A key that does not apply to the thing's kind is absent, for example radius for a box.
Json thing_row(const SceneThing& thing, Things things);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_SCENE_ROWS_H_
