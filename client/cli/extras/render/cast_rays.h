// Query of a picture's rays: one ray a pixel, sent in batches over a query stream with a bounded number in flight. For
// `locus render`.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_RENDER_CAST_RAYS_H_
#define LOCUS_CLIENT_CLI_EXTRAS_RENDER_CAST_RAYS_H_

#include <cstdint>
#include <functional>
#include <string>

#include "absl/status/statusor.h"
#include "client/cli/extras/render/camera.h"
#include "client/cli/extras/render/ray_image.h"
#include "client/lib/client.h"
#include "client/lib/values.h"

namespace locus::cli {

// Choice of the revisions at which the rays are answered.
enum class Moment {
  kOne,   // all rays at the given revision; fails if the server drops it meanwhile
  kLive,  // each batch at the latest revision, which is the given one or newer
};

// Choice of reporting each ray's work. kReported makes every ray a block of its own, which costs several times more.
enum class WorkReport { kNone, kReported };

struct CastOptions {
  std::string scene;
  client::Revision revision;
  Moment moment = Moment::kOne;
  v1::Cull cull = v1::CULL_UNSPECIFIED;
  v1::Source source = v1::SOURCE_UNSPECIFIED;
  uint32_t mask = 0xFFFFFFFFu;
  WorkReport work = WorkReport::kNone;
};

struct CastResult {
  RayImage image;
  // Oldest and newest revision of the answers (equal for Moment::kOne), and the latest tick.
  uint64_t first_revision = 0;
  uint64_t last_revision = 0;
  uint64_t tick = 0;
};

// Callback for progress, called from time to time in the caller's thread with the number of rays answered so far.
using CastProgress = std::function<void(uint64_t done)>;

// Casts all rays and blocks until every ray is answered. Errors: the server's; OUT_OF_RANGE, with an explanation, for a
// revision that the server no longer keeps; DATA_LOSS for an answer whose columns do not match the request. Memory: 28
// bytes a pixel, 52 with the work.
absl::StatusOr<CastResult> cast_rays(const client::Client& client, const Camera& camera, const ImageSize& size,
                                     const CastOptions& options, const CastProgress& progress = {});

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_CAST_RAYS_H_
