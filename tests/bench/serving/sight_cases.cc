#include "tests/bench/serving/sight_cases.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/status_macros.h"
#include "locus/v1/query_service.grpc.pb.h"
#include "tests/bench/serving/ray_batches.h"
#include "tests/bench/serving/served_level.h"

namespace locus::bench::serving {
namespace {

constexpr const char* kSight = "sight/100x100x3";
constexpr size_t kViewers = 100, kTargets = 100, kSamples = 3;
constexpr double kSightBar = 1.5;

// The matrix of sight between random points of the level, and its segments as rays.
struct SightRequests {
  SightRequests(const BenchMesh& mesh, const std::string& scene) {
    // Coordinates are multiples of a power of two, so that the difference of two points is a float.
    const double grain = std::exp2(std::floor(std::log2(double{mesh.diagonal})) - 18);
    const auto rounded = [grain](float value) { return static_cast<float>(std::round(value / grain) * grain); };
    const std::vector<RayQuery> random = scattered_rays(mesh, kViewers + kTargets);
    sight.set_scene(scene);
    rays.set_scene(scene);
    v1::Sight& matrix = *sight.mutable_batch()->add_blocks()->mutable_sight();
    v1::Rays& segments = *rays.mutable_batch()->add_blocks()->mutable_rays();
    matrix.set_samples_per_target(kSamples);
    for (size_t i = 0; i < kViewers; ++i)
      for (int axis = 0; axis < 3; ++axis) matrix.add_viewers(rounded(random[i].origin[axis]));
    for (size_t i = 0; i < kTargets; ++i) {
      for (size_t sample = 0; sample < kSamples; ++sample) {
        Vec3f at = random[kViewers + i].origin;
        at.z += mesh.diagonal * 0.001f * (static_cast<float>(sample) - 1);
        for (int axis = 0; axis < 3; ++axis) matrix.add_targets(rounded(at[axis]));
      }
    }
    segments.set_mode(v1::RAY_MODE_ANY);
    segments.add_t_max(1);
    for (int viewer = 0; viewer < static_cast<int>(3 * kViewers); viewer += 3) {
      for (int target = 0; target < matrix.targets_size(); ++target) {
        segments.add_origins(matrix.viewers(viewer + target % 3));
        segments.add_directions(matrix.targets(target) - matrix.viewers(viewer + target % 3));
      }
    }
  }

  v1::QueryRequest sight, rays;
};

// Unary calls, one after another.
class SightCalls {
 public:
  explicit SightCalls(const Daemon& daemon) : stub_(v1::QueryService::NewStub(daemon.channel())) {}

  v1::BlockResult ask(const v1::QueryRequest& request) {
    grpc::ClientContext context;
    v1::QueryResponse response;
    const grpc::Status status = stub_->Query(&context, request, &response);
    if (!status.ok() && failure_.ok()) failure_ = failed(status);
    return status.ok() ? std::move(*response.mutable_result()->mutable_blocks(0)) : v1::BlockResult();
  }
  const absl::Status& failure() const { return failure_; }

 private:
  const std::unique_ptr<v1::QueryService::Stub> stub_;
  absl::Status failure_;
};

}  // namespace

absl::Status run_sight_cases(const ServingRun& run) {
  if (!run.wants(kSight)) return absl::OkStatus();
  run.progress(kSight);
  ASSIGN_OR_RETURN(const ServedLevel level, ServedLevel::start(run, "sight"));
  const SightRequests requests(level.mesh, level.scene->name());
  SightCalls calls(*level.daemon);
  std::string matrix, hits;
  const size_t chunks = run.options.quick ? 1 : 8;
  const auto segments = static_cast<double>(kViewers * kTargets * kSamples);
  const double operations = segments * static_cast<double>(chunks);
  const std::vector<Contestant> contestants = {
      {"sight", [&](size_t) { matrix = calls.ask(requests.sight).sight(); }, operations, {}},
      {"any_rays", [&](size_t) { hits = calls.ask(requests.rays).hits(); }, operations, {}}};
  const auto times = race(contestants, chunks, run.options.rounds, wall_seconds);
  if (!calls.failure().ok()) return calls.failure();
  size_t differing = 0, seen = 0;
  for (size_t i = 0; i < matrix.size(); ++i) {
    const auto first = hits.begin() + static_cast<std::ptrdiff_t>(kSamples * i);
    const auto unblocked = std::count(first, first + kSamples, '\0');
    differing += matrix[i] != static_cast<char>(unblocked) ? 1 : 0;
    seen += static_cast<size_t>(unblocked);
  }
  if (differing != 0 || matrix.size() != kViewers * kTargets)
    run.disagree(absl::StrCat(kSight, ": ", differing, " targets differ from rays of mode ANY"));
  add_cells(contestants, times, cell_of(kSight, "ns/segment", hash_of_number(seen)), run.report);
  note_bar(run.report, kSightBar,
           absl::StrFormat(" (%.0f %% blocked; requests of %d and %d bytes)",
                           100 * (1 - static_cast<double>(seen) / segments), requests.sight.ByteSizeLong(),
                           requests.rays.ByteSizeLong()));
  return absl::OkStatus();
}

}  // namespace locus::bench::serving
