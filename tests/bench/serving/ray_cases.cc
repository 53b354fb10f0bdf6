#include "tests/bench/serving/ray_cases.h"

#include <cmath>
#include <utility>

#include "tests/bench/serving/ray_batches.h"

namespace locus::bench::serving {
namespace {

constexpr size_t kThreads = 2;  // for two cores: streams of the client, threads in process

// Size of a batch, its cost beside the queries (a message, in nanoseconds per query), and the required share of the
// possible rate. `window` messages in flight on each stream fit into the second-level cache.
struct Size {
  size_t rays;
  size_t window;
  double overhead;
  double share;
};
constexpr Size kSizes[] = {{1024, 4, 45, 0.95}, {8192, 2, 20, 0.92}};

// Workloads, named by the approximate cost of a ray in process: neighbouring rays of a picture, and rays between random
// points.
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

std::string hash_of_all(const std::vector<uint64_t>& hashes) {
  ResultsHash hash;
  for (const uint64_t one : hashes) hash.add(one);
  return hash.text();
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
    check(name, server.hashes(), here);
    if (!server.status().ok()) return server.status();
    const auto count = static_cast<double>(batches.queries) * static_cast<double>(chunks());
    const std::vector<Contestant> contestants = {{"grpc", [&](size_t) { server.run(1); }, count, {}},
                                                 {"in_process", [&](size_t) { process.run(1); }, count, {}}};
    const auto times = race(contestants, chunks(), run_.options.rounds, wall_seconds);
    add_cells(contestants, times, cell_of(name, "ns/ray", hash_of_all(here)), run_.report);
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
    check(name, one.hashes(), hashes);
    const auto count = static_cast<double>(batches.queries) * static_cast<double>(chunks());
    const std::vector<Contestant> contestants = {{"one", [&](size_t) { one.run(1); }, count, {}},
                                                 {"two_streams", [&](size_t) { two.run(1); }, count, {}}};
    const auto times = race(contestants, chunks(), run_.options.rounds, wall_seconds);
    add_cells(contestants, times, cell_of(name, "ns/ray", hash_of_all(hashes)), run_.report);
    constexpr double kBar = 0.9;
    note_bar(run_.report, kBar);
    absl::Status status = one.status();
    status.Update(two.status());
    return status;
  }

 private:
  size_t chunks() const { return run_.options.quick ? 1 : 8; }

  void check(const std::string& name, const std::vector<uint64_t>& theirs, const std::vector<uint64_t>& ours) const {
    size_t differ = 0;
    for (size_t i = 0; i < ours.size(); ++i) differ += theirs[i] != ours[i] ? 1 : 0;
    if (differ != 0)
      run_.disagree(absl::StrCat(name, ": ", differ, " of ", ours.size(), " batches have other answers over gRPC"));
  }

  // Notes whether the ratio reaches the bar. `cost`: nanoseconds of one core for a ray in process.
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
  const absl::StatusOr<BenchMesh> mesh = level_of(run);
  if (!mesh.ok()) return mesh.status();
  const auto daemon = Daemon::start();
  if (!daemon.ok()) return daemon.status();
  TwinScene scene(**daemon, "rays");
  absl::Status status = scene.create();
  status.Update(scene.place(*mesh));
  RayCases cases(run, *mesh, scene);
  for (const Work& work : {kCoherent, kScattered})
    for (const Size& size : kSizes)
      if (status.ok()) status = cases.compare_with_process(work, size);
  for (const Size& size : kSizes)
    if (status.ok()) status = cases.compare_streams(size);
  return status;
}

}  // namespace locus::bench::serving
