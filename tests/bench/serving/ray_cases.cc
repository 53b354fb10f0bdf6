#include "tests/bench/serving/ray_cases.h"

#include <cmath>
#include <utility>

#include "core/base/status_macros.h"
#include "tests/bench/serving/ray_batches.h"
#include "tests/bench/serving/served_level.h"

namespace locus::bench::serving {
namespace {

constexpr size_t kThreads = 2;  // number of streams to the server, and of threads in process: one for each of two cores

// A size of batches. `rays`: rays per batch. `window`: messages in flight per stream, so few that they fit into the
// second-level cache. `overhead`: cost of a message without its queries, in nanoseconds per ray. `share`: required part
// of the rate that is possible with this overhead.
struct Size {
  size_t rays;
  size_t window;
  double overhead;
  double share;
};
constexpr Size kSizes[] = {{1024, 4, 45, 0.95}, {8192, 2, 20, 0.92}};

// A workload, named after the approximate cost of a ray in process: kCoherent has neighbouring rays of a picture,
// kScattered rays from random points in random directions.
struct Work {
  const char* name;
  double nanoseconds;
};
constexpr Work kCoherent = {"90ns", 90};
constexpr Work kScattered = {"270ns", 270};

std::vector<RayQuery> rays_of(const ServingRun& run, const BenchMesh& mesh, const Work& work) {
  const size_t count = run.options.quick ? 65'536 : 524'288;
  return work.name == kCoherent.name ? coherent_rays(mesh, count) : scattered_rays(mesh, count);
}

class RayCases {
 public:
  RayCases(const ServingRun& run, const BenchMesh& mesh, TwinScene& scene) : run_(run), mesh_(mesh), scene_(scene) {}

  absl::Status compare_with_process(const Work& work, const Size& size) {
    const std::string name = absl::StrCat("rays/", work.name, "/", size.rays);
    if (!run_.wants(name)) return absl::OkStatus();
    run_.progress(name);
    Batches batches = batches_of(rays_of(run_, mesh_, work), size.rays, scene_.name());
    ServerLoad server(scene_.daemon(), batches, kThreads, size.window);
    const LocalLoad process(scene_.here().latest(), batches, kThreads);
    const std::vector<uint64_t> here = process.hashes();
    check_answers(run_, name, server.hashes(), here);
    if (!server.status().ok()) return server.status();
    const auto count = static_cast<double>(batches.queries) * static_cast<double>(chunks());
    const std::vector<Contestant> contestants = {{"grpc", [&](size_t) { server.run(1); }, count, {}},
                                                 {"in_process", [&](size_t) { process.run(1); }, count, {}}};
    const auto times = race(contestants, chunks(), run_.options.rounds, wall_seconds);
    add_cells(contestants, times, cell_of(name, "ns/ray", hash_of_numbers(here)), run_.report);
    note_overhead_bar(work, size, kThreads * median(times[1]));
    return server.status();
  }

  absl::Status compare_streams(const Size& size) {
    const std::string name = absl::StrCat("one_stream/", size.rays);
    if (!run_.wants(name)) return absl::OkStatus();
    run_.progress(name);
    Batches batches = batches_of(rays_of(run_, mesh_, kScattered), size.rays, scene_.name());
    ServerLoad one(scene_.daemon(), batches, 1, kThreads * size.window);
    ServerLoad two(scene_.daemon(), batches, kThreads, size.window);
    const std::vector<uint64_t> hashes = two.hashes();
    check_answers(run_, name, one.hashes(), hashes);
    const auto count = static_cast<double>(batches.queries) * static_cast<double>(chunks());
    const std::vector<Contestant> contestants = {{"one", [&](size_t) { one.run(1); }, count, {}},
                                                 {"two_streams", [&](size_t) { two.run(1); }, count, {}}};
    const auto times = race(contestants, chunks(), run_.options.rounds, wall_seconds);
    add_cells(contestants, times, cell_of(name, "ns/ray", hash_of_numbers(hashes)), run_.report);
    constexpr double kBar = 0.9;
    note_bar(run_.report, kBar);
    absl::Status status = one.status();
    status.Update(two.status());
    return status;
  }

 private:
  size_t chunks() const { return run_.options.quick ? 1 : 8; }

  // Notes in the report whether the ratio of the daemon's ray rate to the ray rate of direct calls of the library
  // reaches its required minimum. The minimum is computed from `cost`: the nanoseconds that one thread takes for a ray
  // in process, without gRPC.
  void note_overhead_bar(const Work& work, const Size& size, double cost) const {
    constexpr double kNameHolds = 0.2;
    note_bar(run_.report, size.share * cost / (cost + size.overhead),
             absl::StrFormat(" = %.2f c/(c+%.0f) at c = %.0f ns in process", size.share, size.overhead, cost));
    if (!run_.options.quick && std::abs(cost / work.nanoseconds - 1) > kNameHolds)
      run_.note(absl::StrFormat("%s: on this machine now %.0f ns", work.name, cost));
  }

  const ServingRun& run_;
  const BenchMesh& mesh_;
  TwinScene& scene_;
};

bool wants_any(const ServingRun& run) {
  for (const Size& size : kSizes) {
    if (run.wants(absl::StrCat("one_stream/", size.rays))) return true;
    for (const Work& work : {kCoherent, kScattered})
      if (run.wants(absl::StrCat("rays/", work.name, "/", size.rays))) return true;
  }
  return false;
}

}  // namespace

absl::Status run_ray_cases(const ServingRun& run) {
  if (!wants_any(run)) return absl::OkStatus();
  ASSIGN_OR_RETURN(const ServedLevel level, ServedLevel::start(run, "rays"));
  RayCases cases(run, level.mesh, *level.scene);
  absl::Status status;
  for (const Work& work : {kCoherent, kScattered})
    for (const Size& size : kSizes)
      if (status.ok()) status = cases.compare_with_process(work, size);
  for (const Size& size : kSizes)
    if (status.ok()) status = cases.compare_streams(size);
  return status;
}

}  // namespace locus::bench::serving
