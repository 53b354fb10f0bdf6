// The world bounds of one object or instance, found by asking alone: the protocol tells where a thing stands, not how
// far it reaches. For `locus render --at`.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_THING_BOUNDS_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_THING_BOUNDS_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "client/lib/client.h"
#include "client/lib/values.h"
#include "core/geometry/aabb.h"

namespace locus::cli {

// Bounds of what has `id` at `revision`, which is kept, within `scene_bounds`: outer bounds, too wide on each side by
// at most a twelfth of the thing's extent along that axis. NOT_FOUND if the scene has no such id, or if queries cannot
// see it (layers 0). Method: each side is moved in by a sixteenfold section with box queries, which tell by `after_id`
// = id - 1 and `max_results` = 1 whether this very thing reaches into a slab. Cost: one batch of 90 boxes a round, a
// round or two for a thing as large as the scene, one more for each factor of sixteen that it is smaller; at most 16.
absl::StatusOr<Aabbd> thing_bounds(const client::Client& client, const std::string& scene,
                                   const client::Revision& revision, uint64_t id, const Aabbd& scene_bounds);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_THING_BOUNDS_H_
