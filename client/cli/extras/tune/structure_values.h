// The values and queries of a scene in the types of core/geometry, for `locus tune --structures`. Functions without
// state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TUNE_STRUCTURE_VALUES_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TUNE_STRUCTURE_VALUES_H_

#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/extras/tune/object_batches.h"
#include "client/cli/extras/tune/query_set.h"
#include "client/cli/extras/tune/structures/family.h"
#include "client/lib/client.h"
#include "core/base/progress_writer.h"

namespace locus::cli {

// Largest numbers of values that are timed, which keeps the memory of this process below a few gigabytes.
inline constexpr uint64_t kMaxTimedShapes = 1'000'000, kMaxTimedTriangles = 1'000'000;

// Returns the shapes of all objects, relative to `frame`. The parts of a compound count one by one.
absl::StatusOr<std::vector<PlacedShape>> shapes_of(const ObjectBatches& objects, const Vec3d& frame);

// Downloads the meshes of all instances and returns the triangles of the instances, relative to `frame`.
absl::StatusOr<std::vector<Triangle>> triangles_of(const client::Client& client, const ObjectBatches& objects,
                                                   const Vec3d& frame, ProgressWriter& progress);

// Returns the rays, balls, boxes and nearest queries of the set, relative to `frame`, in an order that does not depend
// on that of the set's places. Queries of other kinds are left out, and so are filters.
FamilyQueries family_queries(const QuerySet& queries, const Vec3d& frame);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TUNE_STRUCTURE_VALUES_H_
