#include "client/cli/extras/render/cast_rays.h"

#include <algorithm>
#include <array>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/lib/query_builder.h"
#include "client/lib/query_stream.h"
#include "client/lib/result_rows.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr uint64_t kRaysPerBatch = 8192;
constexpr uint64_t kReportedRaysPerBatch = 256;  // one block per ray; equals the maximum number of blocks of a batch
constexpr int kBatchesInFlight = 6;
constexpr std::array<v1::Column, 4> kColumns = {v1::COLUMN_T, v1::COLUMN_ID, v1::COLUMN_TRIANGLE, v1::COLUMN_NORMAL};

// Range of consecutive pixels. Pixels are numbered row by row from the upper left.
struct PixelRange {
  uint64_t begin = 0;
  uint64_t end = 0;

  uint64_t size() const { return end - begin; }
};

class Caster {
 public:
  Caster(const Camera& camera, const ImageSize& size, const CastOptions& options)
      : camera_(camera), options_(options), result_{RayImage(size)} {
    if (options.work == WorkReport::kReported) result_.image.work.resize(size.pixels());
  }

  absl::StatusOr<CastResult> run(const client::Client& client, const CastProgress& progress) {
    const std::unique_ptr<client::QueryStream> stream =
        client.query_stream(options_.scene, {.max_in_flight = kBatchesInFlight, .reconnect = {}});
    const uint64_t pixels = result_.image.size.pixels();
    const uint64_t step = options_.work == WorkReport::kReported ? kReportedRaysPerBatch : kRaysPerBatch;
    for (uint64_t begin = 0; begin < pixels && outcome().ok(); begin += step) {
      const PixelRange range = {begin, std::min(begin + step, pixels)};
      const absl::Status sent = stream->send(batch_of(range), [this, range](absl::StatusOr<v1::QueryResult> answer) {
        note(answer.ok() ? take(range, *answer) : answer.status(), range);
      });
      if (!sent.ok()) note(sent, {});
      if (progress) progress(done());
    }
    // Wait for all answers even after a failure, since their callbacks write into this object.
    const absl::Status flushed = stream->flush();
    if (absl::Status status = outcome(); !status.ok()) return in_words(status);
    RETURN_IF_ERROR(flushed);
    return std::move(result_);
  }

 private:
  v1::QueryBatch batch_of(const PixelRange& range) const {
    client::QueryBuilder builder;
    if (options_.revisions == Revisions::kOne) builder.exactly(options_.revision);
    if (options_.revisions == Revisions::kLive) builder.at_least(options_.revision);
    if (options_.work == WorkReport::kNone) {
      add_block(range, builder);
      return builder.build();
    }
    builder.explain();
    for (uint64_t pixel = range.begin; pixel < range.end; ++pixel) add_block({pixel, pixel + 1}, builder);
    return builder.build();
  }

  // Adds a block with the rays of `range`. The frame of the block is the eye, so that the float offsets stay precise
  // even if the eye is far from the origin.
  void add_block(const PixelRange& range, client::QueryBuilder& builder) const {
    std::vector<float> origins;
    std::vector<float> directions;
    origins.reserve(3 * range.size());
    directions.reserve(3 * range.size());
    const uint32_t width = result_.image.size.width;
    for (uint64_t pixel = range.begin; pixel < range.end; ++pixel) {
      const CameraRay ray = ray_through(camera_, result_.image.size, static_cast<uint32_t>(pixel % width),
                                        static_cast<uint32_t>(pixel / width));
      origins.insert(origins.end(), {ray.origin.x, ray.origin.y, ray.origin.z});
      directions.insert(directions.end(), {ray.direction.x, ray.direction.y, ray.direction.z});
    }
    client::RayBlock block = builder.rays();
    block.frame({camera_.eye.x, camera_.eye.y, camera_.eye.z}).source(options_.source).columns(kColumns);
    block.cull(options_.cull).masks({options_.mask});
    block.rays(origins, directions);
  }

  // Copies an answer into the image. Different answers are written to disjoint ranges of the image, so the lock is
  // needed only for the revisions and the tick of the result.
  absl::Status take(const PixelRange& range, const v1::QueryResult& answer) {
    const bool reported = options_.work == WorkReport::kReported;
    const uint64_t rays_per_block = reported ? 1 : range.size();
    if (static_cast<uint64_t>(answer.blocks_size()) * rays_per_block != range.size()) return misfit();
    uint64_t pixel = range.begin;
    for (const v1::BlockResult& block : answer.blocks()) {
      RETURN_IF_ERROR(take_block({pixel, pixel + rays_per_block}, block));
      if (reported) result_.image.work[pixel] = {block.work().nodes(), block.work().cells(), block.work().tests()};
      pixel += rays_per_block;
    }
    std::lock_guard lock(mutex_);
    if (result_.first_revision == 0) result_.first_revision = answer.revision();
    result_.first_revision = std::min(result_.first_revision, answer.revision());
    result_.last_revision = std::max(result_.last_revision, answer.revision());
    result_.tick = std::max(result_.tick, answer.tick());
    return absl::OkStatus();
  }

  absl::Status take_block(const PixelRange& range, const v1::BlockResult& block) {
    ASSIGN_OR_RETURN(const client::RayHits hits, client::RayHits::of(block));
    const client::ResultRows& rows = hits.rows();
    if (rows.rows() != range.size() || hits.size() != range.size() || rows.triangles().size() != range.size() ||
        rows.normals().size() != 3 * range.size()) {
      return misfit();
    }
    RayImage& image = result_.image;
    for (uint64_t i = 0; i < range.size(); ++i) {
      image.t[range.begin + i] = hits.t(i);
      image.ids[range.begin + i] = hits.id(i);
      image.triangles[range.begin + i] = rows.triangles()[i];
      image.normals[range.begin + i] = {rows.normals()[3 * i], rows.normals()[3 * i + 1], rows.normals()[3 * i + 2]};
    }
    return absl::OkStatus();
  }

  static absl::Status misfit() { return absl::DataLossError("the answer does not have one row for each ray"); }

  absl::Status in_words(const absl::Status& status) const {
    if (!absl::IsOutOfRange(status) || options_.revisions == Revisions::kLive) return status;
    return absl::OutOfRangeError(absl::StrCat(
        "the scene changed faster than its picture was taken: revision ", options_.revision.revision,
        " is kept no longer; give a smaller --size, or --live to let each batch of rays see the latest revision"));
  }

  void note(const absl::Status& status, const PixelRange& range) {
    std::lock_guard lock(mutex_);
    outcome_.Update(status);
    done_ += range.size();
  }
  absl::Status outcome() {
    std::lock_guard lock(mutex_);
    return outcome_;
  }
  uint64_t done() {
    std::lock_guard lock(mutex_);
    return done_;
  }

  const Camera& camera_;
  const CastOptions& options_;
  CastResult result_;  // mutex_ guards its revisions and its tick, not its image

  std::mutex mutex_;
  absl::Status outcome_;  // first error
  uint64_t done_ = 0;
};

}  // namespace

absl::StatusOr<CastResult> cast_rays(const client::Client& client, const Camera& camera, const ImageSize& size,
                                     const CastOptions& options, const CastProgress& progress) {
  return Caster(camera, size, options).run(client, progress);
}

}  // namespace locus::cli
