// World bounds of one object or instance ("thing"), found by queries: the protocol returns its position, but not its
// extent. For `locus render --at`.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_THING_BOUNDS_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_THING_BOUNDS_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "client/lib/client.h"
#include "client/lib/values.h"
#include "core/geometry/aabb.h"

namespace locus::cli {

// Returns outer bounds of the object or instance `id` at `revision`, which the server must still keep. They lie within
// `scene_bounds` and are too wide on each side by at most a twelfth of the thing's extent along that axis. NOT_FOUND if
// the scene has no such id, or if queries cannot see it (layers 0). Method: 16-way section search for each side, with
// box queries that report whether the thing overlaps a slab; `after_id` = id - 1 and `max_results` = 1 restrict the
// answer to its id. Cost: one batch of 90 boxes a round; one or two rounds for a thing as large as the scene, one more
// for each factor of 16 by which it is smaller; at most 16 rounds.
absl::StatusOr<Aabbd> thing_bounds(const client::Client& client, const std::string& scene,
                                   const client::Revision& revision, uint64_t id, const Aabbd& scene_bounds);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_THING_BOUNDS_H_
