// Times of the structures of core/index on the values and queries of a scene, in this process. For `locus tune
// --structures`, that is for programs that link locus::index. Plain data and functions without state; one thread.
//
// This folder is a library of its own, since it is optimised like the structures' users would optimise them, and the
// rest of the command line is not.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TUNE_STRUCTURES_FAMILY_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TUNE_STRUCTURES_FAMILY_H_

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "core/geometry/obb.h"
#include "core/geometry/shape.h"
#include "core/geometry/triangle.h"

namespace locus::cli {

// Shape of an object or of a part of a compound. `id` is unique among the shapes.
struct PlacedShape {
  uint64_t id = 0;
  Shape shape;
};

struct NearestPoint {
  Vec3d point;
  double max_distance = 0;
  uint32_t k = 1;
};

// Queries in the axes of the values. Empty lists are kinds that are not timed.
struct FamilyQueries {
  std::vector<Rayd> rays;
  std::vector<Balld> balls;
  std::vector<Obbd> boxes;
  std::vector<NearestPoint> nearest;
};

struct StructureFigures {
  std::string name;
  double build_ms = 0;
  uint64_t bytes = 0;                         // heap memory of the structure with its values
  std::map<std::string, double> nanoseconds;  // of a query, by kind: balls, boxes, nearest, rays
};

struct FamilyOptions {
  int rounds = 5;
  // Maximum processor time of a structure and kind in one round; at least 16 queries are asked if there are so many.
  double milliseconds = 10;
};

// Called before each step with the number of steps done and of all steps. Returns an error to stop.
using FamilyProgress = std::function<absl::Status(uint64_t done, uint64_t total)>;

// Build each structure and time the queries in turns: in every round, each structure answers each kind; the median of
// the rounds counts. Times are processor times of this thread. The structures are list, bvh, hash_grid, grid, kd_tree,
// octree, bsp_tree and sphere_tree, each with its default options. Return the error of `progress`. Precondition:
// `values` is not empty.
absl::StatusOr<std::vector<StructureFigures>> time_shapes(const std::vector<PlacedShape>& values,
                                                          const FamilyQueries& queries, const FamilyOptions& options,
                                                          const FamilyProgress& progress);
absl::StatusOr<std::vector<StructureFigures>> time_triangles(const std::vector<Triangle>& values,
                                                             const FamilyQueries& queries, const FamilyOptions& options,
                                                             const FamilyProgress& progress);

// Returns the name of the fastest structure for each kind. Ties go to the earlier structure.
std::map<std::string, std::string> best_structures(absl::Span<const StructureFigures> figures);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TUNE_STRUCTURES_FAMILY_H_
