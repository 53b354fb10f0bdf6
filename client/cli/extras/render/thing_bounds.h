// World bounds of one object or instance ("thing"). They are determined by queries, since the protocol returns the
// position of a thing but not its extent. For `locus render --at`.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_THING_BOUNDS_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_THING_BOUNDS_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "client/lib/client.h"
#include "client/lib/values.h"
#include "core/geometry/aabb.h"

namespace locus::cli {

// Returns bounds that contain the object or instance `id` at `revision`, which the server must still retain. On each
// side the bounds exceed the thing by at most a twelfth of its extent along that axis. Along an axis in which the thing
// is flat, the excess can be larger, but is small compared with the longest side of the thing. Returns NOT_FOUND if the
// scene has no such id, or if the thing is hidden from queries (layers 0). Method: The box begins as the bounds of the
// scene. Each side of the box has 15 slabs, which extend from that side inward by 1/16, 2/16 .. 15/16 of the box's
// size. A round tests the slabs of all six sides, and moves each side inward past the slabs that the thing does not
// overlap. Each slab is a box query with `after_id` = id - 1 and `max_results` = 1; the thing overlaps the slab if the
// answer is `id`. Cost: a batch of 90 boxes per round. A thing as large as the scene takes one or two rounds. A smaller
// thing takes one more round for each factor of 16 between its size and the scene's size; there are at most 16 rounds.
absl::StatusOr<Aabbd> thing_bounds(const client::Client& client, const std::string& scene,
                                   const client::Revision& revision, uint64_t id, const Aabbd& scene_bounds);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_THING_BOUNDS_H_
