// Sender of a picture's rays: queries one ray per pixel, in batches over a query stream with a bounded number of
// batches in flight. For `locus render`.
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

// Choice of the revision or revisions at which the rays are answered.
enum class Revisions {
  kOne,   // all rays at CastOptions::revision; fails if the server drops this revision meanwhile
  kLive,  // each batch at the newest revision, which is at least CastOptions::revision
};

// Choice whether the server reports the work of each ray. With kReported each ray is sent as a block of its own,
// because the server reports work per block; this takes several times longer.
enum class WorkReport { kNone, kReported };

struct CastOptions {
  std::string scene;
  client::Revision revision;
  Revisions revisions = Revisions::kOne;
  v1::Cull cull = v1::CULL_UNSPECIFIED;
  v1::Source source = v1::SOURCE_UNSPECIFIED;
  uint32_t mask = 0xFFFFFFFFu;
  WorkReport work = WorkReport::kNone;
};

struct CastResult {
  RayImage image;
  // Oldest and newest revision of the answers (equal with Revisions::kOne), and the newest tick.
  uint64_t first_revision = 0;
  uint64_t last_revision = 0;
  uint64_t tick = 0;
};

// Callback for progress. It is called from time to time in the caller's thread with the number of rays answered so far.
using CastProgress = std::function<void(uint64_t done)>;

// Sends all rays and waits until every ray is answered. Returns the errors of the server; if the server has dropped the
// revision, returns OUT_OF_RANGE with an explanation. Returns DATA_LOSS if the columns of an answer do not match the
// request. Memory: 28 bytes per pixel, 52 if the work is reported.
absl::StatusOr<CastResult> cast_rays(const client::Client& client, const Camera& camera, const ImageSize& size,
                                     const CastOptions& options, const CastProgress& progress = {});

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_RENDER_CAST_RAYS_H_
