#include "tests/bench/static/region_cases.h"

#include <optional>

#include "core/geometry/ray_triangle.h"
#include "core/geometry/triangle_overlap.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/frame/results_hash.h"
#include "tests/bench/static/agreement.h"

namespace locus::bench {
namespace {

struct RegionCase {
  const char* name;
  Task task;
  float fraction;  // radius or size as a part of the mesh's diagonal
  uint64_t seed;
  size_t count;  // number of queries; a tenth of it for meshes of more than a million triangles
  size_t quick_count;
  size_t chunk;
};
constexpr RegionCase kCases[] = {{"ray/incoherent/all", Task::kAll, 0, 101, 100'000, 640, 10'000},
                                 {"ball/0.5", Task::kBall, 0.005f, 301, 50'000, 640, 5'000},
                                 {"ball/2", Task::kBall, 0.02f, 302, 20'000, 384, 2'000},
                                 {"ball/10", Task::kBall, 0.10f, 303, 4'000, 256, 500},
                                 {"box/0.5", Task::kBox, 0.005f, 401, 50'000, 640, 5'000},
                                 {"box/2", Task::kBox, 0.02f, 402, 20'000, 384, 2'000},
                                 {"box/10", Task::kBox, 0.10f, 403, 4'000, 256, 500}};

size_t query_count(const RegionCase& region_case, const MeshRun& run) {
  constexpr size_t kManyTriangles = 1'000'000;
  if (run.options.quick) return region_case.quick_count;
  return run.mesh.triangles.size() > kManyTriangles ? region_case.count / 10 : region_case.count;
}

void ask(Peer& peer, absl::Span<const RayQuery> rays, absl::Span<uint32_t> ids, uint32_t* counts) {
  peer.ray_ids(rays, ids, counts);
}
void ask(Peer& peer, absl::Span<const Ballf> balls, absl::Span<uint32_t> ids, uint32_t* counts) {
  peer.ball_ids(balls, ids, counts);
}
void ask(Peer& peer, absl::Span<const Obbf> boxes, absl::Span<uint32_t> ids, uint32_t* counts) {
  peer.box_ids(boxes, ids, counts);
}
bool overlaps(const RayQuery& query, const Triangle& triangle) {
  const TriangleRay ray(to_double(query.origin), to_double(query.direction));
  const std::optional<TriangleHit> hit = ray.hit(triangle);
  return hit && ray.from_scaled(hit->t) <= query.t_max;
}
bool overlaps(const Ballf& ball, const Triangle& triangle) { return ball_overlaps(ball, triangle); }
bool overlaps(const Obbf& box, const Triangle& triangle) { return box_overlaps(box, triangle); }

template <class Query>
struct Entry {
  Peer* peer;
  Asked<Query> asked;
  std::vector<uint32_t> counts;  // number of ids of each query
};

// Hash of a set of ids, independent of the order of the ids.
struct SetOfIds {
  uint32_t count = 0;
  uint64_t sum = 0;
  friend bool operator==(const SetOfIds&, const SetOfIds&) = default;
};

SetOfIds set_of(absl::Span<const uint32_t> ids) {
  SetOfIds set{static_cast<uint32_t>(ids.size()), 0};
  for (const uint32_t id : ids) set.sum += (uint64_t{id} + 1) * (uint64_t{id} ^ 0x9E3779B97F4A7C15u);
  return set;
}

// Comparison and measurement of one case: runs the queries and adds the cells.
template <class Query>
class RegionRace {
 public:
  RegionRace(const MeshRun& run, const RegionCase& region_case, std::vector<Query> queries)
      : run_(run),
        case_(region_case),
        name_(case_of(region_case.name, run.mesh)),
        queries_(std::move(queries)),
        ids_(run.mesh.triangles.size() + kSpareIds) {
    enter(run.ours);
    for (const auto& peer : run.peers)
      if (peer->does(region_case.task)) enter(*peer);
  }

  void run() {
    compare_all();
    const size_t chunks = chunks_for(queries_.size(), case_.chunk);
    std::vector<Contestant> contestants;
    for (Entry<Query>& entry : entries_) contestants.push_back(contestant(entry, chunks));
    const auto times = race(contestants, chunks, run_.options.rounds, thread_seconds, WarmUp::kDone);
    Cell cell;
    cell.suite = "static";
    cell.case_name = name_;
    cell.metric = "ns/query";
    cell.results_hash = hash_.text();
    add_cells(contestants, times, cell, run_.report);
    check_counts();
  }

 private:
  void enter(Peer& peer) {
    entries_.push_back({&peer, asked_of(peer, queries_), {}});
    entries_.back().counts.resize(entries_.back().asked.queries.size());
  }

  absl::Span<const uint32_t> ids_of(Peer& peer, const Query& query) {
    uint32_t count = 0;
    ask(peer, absl::MakeConstSpan(&query, 1), absl::MakeSpan(ids_), &count);
    return absl::MakeConstSpan(ids_.data(), count);
  }

  // Compares the results of all peers with those of locus, query by query, before the race.
  void compare_all() {
    for (const Query& query : queries_) {
      sets_.push_back(set_of(ids_of(run_.ours, query)));
      hash_.add(sets_.back().sum);
    }
    for (size_t i = 1; i < entries_.size(); ++i) compare(entries_[i]);
  }

  void compare(const Entry<Query>& entry) {
    RegionTally tally;
    for (size_t i = 0; i < entry.asked.queries.size(); ++i) {
      const SetOfIds& ours = sets_[entry.asked.places[i]];
      tally.all_ids += ours.count;
      if (set_of(ids_of(*entry.peer, entry.asked.queries[i])) != ours)
        settle(entry, entry.asked.queries[i], entry.asked.places[i], tally);
    }
    report_tally(name_, *entry.peer, case_.task, tally, run_.report);
  }

  void settle(const Entry<Query>& entry, const Query& query, size_t place, RegionTally& tally) {
    const auto copy = [&](Peer& peer) {
      const absl::Span<const uint32_t> ids = ids_of(peer, query);
      return std::vector<uint32_t>(ids.begin(), ids.end());
    };
    const std::string where = absl::StrCat("query ", place);
    const auto decide = [&](uint32_t id) { return overlaps(query, run_.mesh.triangles[id]); };
    compare_ids(absl::StrCat(name_, ", ", where), copy(run_.ours), copy(*entry.peer), decide, tally, run_.report);
  }

  Contestant contestant(Entry<Query>& entry, size_t chunks) {
    const size_t count = entry.asked.queries.size();
    const auto run_chunk = [this, &entry, count, chunks](size_t chunk) {
      const size_t begin = chunk_begin(count, chunk, chunks), end = chunk_begin(count, chunk + 1, chunks);
      ask(*entry.peer, absl::MakeConstSpan(entry.asked.queries).subspan(begin, end - begin), absl::MakeSpan(ids_),
          entry.counts.data() + begin);
    };
    return {entry.peer->name(), run_chunk, static_cast<double>(count), {}};
  }

  // Verifies that locus found as many ids in the race as in compare_all().
  void check_counts() {
    const std::vector<uint32_t>& timed = entries_.front().counts;
    for (size_t i = 0; i < timed.size(); ++i) {
      if (timed[i] == sets_[i].count) continue;
      run_.report.disagreements.push_back(
          absl::StrCat(name_, ": in a batch, query ", i, " gives ", timed[i], " ids and alone ", sets_[i].count));
      return;
    }
  }

  const MeshRun& run_;
  const RegionCase& case_;
  const std::string name_;
  const std::vector<Query> queries_;
  std::vector<uint32_t> ids_;
  std::vector<Entry<Query>> entries_;
  std::vector<SetOfIds> sets_;  // hash of the ids that locus found, for each query
  ResultsHash hash_;
};

void run_case(const MeshRun& run, const RegionCase& region_case) {
  const size_t count = query_count(region_case, run);
  if (region_case.task == Task::kAll)
    RegionRace(run, region_case, random_rays(run.mesh, count, region_case.seed, kEndless)).run();
  else if (region_case.task == Task::kBall)
    RegionRace(run, region_case, balls(run.mesh, count, region_case.seed, region_case.fraction)).run();
  else
    RegionRace(run, region_case, boxes(run.mesh, count, region_case.seed, region_case.fraction)).run();
}

}  // namespace

bool wants_region_peers(const Options& options, const BenchMesh& mesh) {
  return std::any_of(std::begin(kCases), std::end(kCases),
                     [&](const RegionCase& one) { return options.filter.wants(case_of(one.name, mesh)); });
}

void run_region_cases(const MeshRun& run) {
  for (const RegionCase& region_case : kCases) {
    const std::string name = case_of(region_case.name, run.mesh);
    if (!run.options.filter.wants(name)) continue;
    run.progress(name);
    run_case(run, region_case);
  }
}

}  // namespace locus::bench
