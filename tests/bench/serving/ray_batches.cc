#include "tests/bench/serving/ray_batches.h"

#include <sys/stat.h>

#include <algorithm>

namespace locus::bench::serving {
namespace {

constexpr uint64_t kSeed = 101;
constexpr size_t kWidth = 1024;
constexpr const char* kLevel = "/pak1-maps.pk3#maps/delta.bsp";
constexpr const char* kMadeUpLevel = "city:10000";

}  // namespace

absl::StatusOr<BenchMesh> level_of(const ServingRun& run) {
  if (!run.options.meshes.empty()) return load_mesh(run.options.meshes.front());
  const std::string fetched = run.options.levels + kLevel;
  struct stat facts {};
  if (!run.options.quick && stat(fetched.substr(0, fetched.find('#')).c_str(), &facts) == 0) return load_mesh(fetched);
  if (!run.options.quick)
    run.note("the level delta is missing, a generated one is used instead: run tests/bench/fetch_levels.sh");
  return load_mesh(kMadeUpLevel);
}

std::vector<RayQuery> scattered_rays(const BenchMesh& mesh, size_t count) {
  return random_rays(mesh, count, kSeed, kEndless);
}

std::vector<RayQuery> coherent_rays(const BenchMesh& mesh, size_t count) {
  return camera_rays(mesh, kWidth, static_cast<int>(count / kWidth));
}

Batches batches_of(const std::vector<RayQuery>& rays, size_t size, const std::string& scene) {
  Batches batches;
  batches.queries = rays.size();
  for (size_t first = 0; first < rays.size(); first += size) {
    v1::StreamQueriesRequest& message = batches.messages.emplace_back();
    message.set_scene(scene);
    v1::Rays* const columns = message.mutable_batch()->add_blocks()->mutable_rays();
    for (size_t i = first; i < std::min(rays.size(), first + size); ++i) {
      for (const float value : {rays[i].origin.x, rays[i].origin.y, rays[i].origin.z}) columns->add_origins(value);
      for (const float value : {rays[i].direction.x, rays[i].direction.y, rays[i].direction.z})
        columns->add_directions(value);
      columns->add_t_max(rays[i].t_max);
    }
  }
  batches.borrow();
  return batches;
}

void check_answers(const ServingRun& run, const std::string& case_name, const std::vector<uint64_t>& theirs,
                   const std::vector<uint64_t>& ours) {
  size_t differ = 0;
  for (size_t i = 0; i < ours.size(); ++i) differ += theirs[i] != ours[i] ? 1 : 0;
  if (differ != 0)
    run.disagree(absl::StrCat(case_name, ": ", differ, " of ", ours.size(), " batches have other answers over gRPC"));
}

}  // namespace locus::bench::serving
