// Asks a server for a picture: a ray a pixel, in batches over a query stream, a bounded number of them under way. For
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

// Whether all rays see one moment.
enum class Moment {
  kOne,   // all at the given revision; fails if the server drops it meanwhile
  kLive,  // each batch at the latest one, the given one or newer
};

// Whether each ray's work is reported. kReported makes every ray a block of its own, which costs several times more.
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
  // The oldest and newest revision that answered: the same for Moment::kOne. Ticks likewise.
  uint64_t first_revision = 0;
  uint64_t last_revision = 0;
  uint64_t tick = 0;
};

// Called in the caller's thread now and then with the rays answered so far.
using CastProgress = std::function<void(uint64_t done)>;

// Blocks until every ray is answered. The server's refusal otherwise; OUT_OF_RANGE in words for a revision that the
// server does not keep any more; DATA_LOSS for an answer that does not fit its question. Memory: 28 bytes a pixel, 52
// with the work.
absl::StatusOr<CastResult> cast_rays(const client::Client& client, const Camera& camera, const ImageSize& size,
                                     const CastOptions& options, const CastProgress& progress = {});

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_CAST_RAYS_H_
