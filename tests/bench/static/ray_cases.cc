#include "tests/bench/static/ray_cases.h"

#include <barrier>
#include <thread>
#include <utility>

#include "tests/bench/frame/race.h"
#include "tests/bench/frame/results_hash.h"
#include "tests/bench/static/agreement.h"

namespace locus::bench {
namespace {

constexpr size_t kRaysAChunk = 20'000;
// Rays per chunk with several threads: so many that the time of waking the threads does not matter.
constexpr size_t kRaysAThreadsChunk = 60'000;
constexpr uint64_t kIncoherentSeed = 101;
constexpr uint64_t kShortSeed = 202;
constexpr float kShortReach = 0.05f;  // length of a short ray, as a part of the mesh's diagonal

enum class Rays : uint8_t { kIncoherent, kShort, kCamera };
struct RayCase {
  const char* name;
  Rays rays;
  Task task;
};
constexpr RayCase kCases[] = {{"ray/incoherent/first", Rays::kIncoherent, Task::kFirst},
                              {"ray/incoherent/any", Rays::kIncoherent, Task::kAny},
                              {"ray/short/first", Rays::kShort, Task::kFirst},
                              {"ray/short/any", Rays::kShort, Task::kAny},
                              {"ray/camera/first", Rays::kCamera, Task::kFirstOfCamera}};

size_t ray_count(const MeshRun& run) {
  constexpr size_t kManyTriangles = 1'000'000;
  if (run.options.quick) return 20'000;
  return run.mesh.triangles.size() > kManyTriangles ? 400'000 : 500'000;
}

std::vector<RayQuery> rays_of(Rays rays, const MeshRun& run) {
  switch (rays) {
    case Rays::kIncoherent:
      return random_rays(run.mesh, ray_count(run), kIncoherentSeed, kEndless);
    case Rays::kShort:
      return random_rays(run.mesh, ray_count(run), kShortSeed, kShortReach * run.mesh.diagonal);
    case Rays::kCamera:
      break;
  }
  return run.options.quick ? camera_rays(run.mesh, 80, 60) : camera_rays(run.mesh, 1024, 768);
}

void ask(Peer& peer, absl::Span<const RayQuery> rays, RayAnswer* answers) { peer.first(rays, answers); }
void ask(Peer& peer, absl::Span<const RayQuery> rays, uint8_t* answers) { peer.any(rays, answers); }

void add(const RayAnswer& answer, ResultsHash& hash) { hash.add(answer.triangle); }
void add(uint8_t answer, ResultsHash& hash) { hash.add(answer); }

template <class Answer>
std::string hash_of(const std::vector<Answer>& answers) {
  ResultsHash hash;
  for (const Answer& answer : answers) add(answer, hash);
  return hash.text();
}

void compare(const std::string& case_name, const MeshRun& run, const Peer& peer, const RayCase& ray_case,
             const Asked<RayQuery>& asked, const std::vector<RayAnswer>& ours, const std::vector<RayAnswer>& theirs) {
  compare_first(case_name, run.mesh, peer, ray_case.task, asked, ours, theirs, run.report);
}
void compare(const std::string& case_name, const MeshRun& run, const Peer& peer, const RayCase&,
             const Asked<RayQuery>& asked, const std::vector<uint8_t>& ours, const std::vector<uint8_t>& theirs) {
  compare_any(case_name, run.mesh, peer, asked, ours, theirs, run.report);
}

template <class Answer>
struct Entry {
  Peer* peer;
  Asked<RayQuery> asked;
  std::vector<Answer> answers;
};

// Returns an entry for locus, then one for each peer that supports the task.
template <class Answer>
std::vector<Entry<Answer>> entries_of(const MeshRun& run, Task task, const std::vector<RayQuery>& rays) {
  std::vector<Entry<Answer>> entries;
  const auto enter = [&](Peer& peer) {
    entries.push_back({&peer, asked_of(peer, rays), {}});
    entries.back().answers.resize(entries.back().asked.queries.size());
  };
  enter(run.ours);
  for (const auto& peer : run.peers)
    if (peer->does(task)) enter(*peer);
  return entries;
}

template <class Answer>
Contestant contestant(Entry<Answer>& entry, size_t chunks) {
  const size_t count = entry.asked.queries.size();
  const auto run_chunk = [&entry, count, chunks](size_t chunk) {
    const size_t begin = chunk_begin(count, chunk, chunks), end = chunk_begin(count, chunk + 1, chunks);
    ask(*entry.peer, absl::MakeConstSpan(entry.asked.queries).subspan(begin, end - begin),
        entry.answers.data() + begin);
  };
  return {entry.peer->name(), run_chunk, static_cast<double>(count), {}};
}

template <class Answer>
void run_case(const MeshRun& run, const RayCase& ray_case) {
  const std::string name = case_of(ray_case.name, run.mesh);
  const std::vector<RayQuery> rays = rays_of(ray_case.rays, run);
  const size_t chunks = chunks_for(rays.size(), kRaysAChunk);
  std::vector<Entry<Answer>> entries = entries_of<Answer>(run, ray_case.task, rays);
  std::vector<Contestant> contestants;
  for (Entry<Answer>& entry : entries) contestants.push_back(contestant(entry, chunks));
  const auto times = race(contestants, chunks, run.options.rounds, thread_seconds);
  Cell cell;
  cell.suite = "static";
  cell.case_name = name;
  cell.metric = "ns/ray";
  cell.results_hash = hash_of(entries.front().answers);
  add_cells(contestants, times, cell, run.report);
  for (size_t i = 1; i < entries.size(); ++i)
    compare(name, run, *entries[i].peer, ray_case, entries[i].asked, entries[0].answers, entries[i].answers);
}

std::string threads_case(const MeshRun& run) { return case_of(absl::StrCat("threads", run.options.threads), run.mesh); }

// Threads that wait for the next chunk. They are not started for each chunk, since starting a thread can take longer
// than a chunk.
class Team {
 public:
  // Starts `members` - 1 threads. `work` gets a member's index, from 0; member 0 is the thread that calls run().
  Team(size_t members, std::function<void(size_t member)> work)
      : work_(std::move(work)), begin_(static_cast<ptrdiff_t>(members)), end_(static_cast<ptrdiff_t>(members)) {
    for (size_t member = 1; member < members; ++member) {
      others_.emplace_back([this, member] {
        for (begin_.arrive_and_wait(); !over_; begin_.arrive_and_wait()) {
          work_(member);
          end_.arrive_and_wait();
        }
      });
    }
  }
  ~Team() {
    over_ = true;
    begin_.arrive_and_wait();
    for (std::thread& other : others_) other.join();
  }
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;

  void run() {
    begin_.arrive_and_wait();
    work_(0);
    end_.arrive_and_wait();
  }

 private:
  std::function<void(size_t)> work_;
  std::barrier<> begin_, end_;
  bool over_ = false;
  std::vector<std::thread> others_;
};

// Rays that several threads of locus answer: each thread gets a part of every chunk.
class SharedRays {
 public:
  SharedRays(Peer& peer, const std::vector<RayQuery>& rays, size_t chunks, size_t threads)
      : peer_(peer),
        rays_(rays),
        chunks_(chunks),
        threads_(threads),
        answers_(rays.size()),
        team_(threads, [this](size_t member) { ask_part(member); }) {}

  Contestant contestant(std::string name) {
    const auto run_chunk = [this](size_t chunk) {
      chunk_ = chunk;
      team_.run();
    };
    return {std::move(name), run_chunk, static_cast<double>(rays_.size()), {}};
  }
  const std::vector<RayAnswer>& answers() const { return answers_; }

 private:
  void ask_part(size_t member) {
    const size_t part = chunk_ * threads_ + member, parts = chunks_ * threads_;
    const size_t begin = chunk_begin(rays_.size(), part, parts), end = chunk_begin(rays_.size(), part + 1, parts);
    peer_.first(absl::MakeConstSpan(rays_).subspan(begin, end - begin), answers_.data() + begin);
  }

  Peer& peer_;
  const std::vector<RayQuery>& rays_;
  const size_t chunks_, threads_;
  std::vector<RayAnswer> answers_;
  size_t chunk_ = 0;
  Team team_;
};

}  // namespace

bool wants_ray_peers(const Options& options, const BenchMesh& mesh) {
  return std::any_of(std::begin(kCases), std::end(kCases),
                     [&](const RayCase& one) { return options.filter.wants(case_of(one.name, mesh)); });
}

void run_ray_cases(const MeshRun& run) {
  for (const RayCase& ray_case : kCases) {
    const std::string name = case_of(ray_case.name, run.mesh);
    if (!run.options.filter.wants(name)) continue;
    run.progress(name);
    if (ray_case.task == Task::kAny)
      run_case<uint8_t>(run, ray_case);
    else
      run_case<RayAnswer>(run, ray_case);
  }
}

void run_threads_case(const MeshRun& run) {
  const std::string name = threads_case(run);
  if (!run.options.filter.wants(name)) return;
  run.progress(name);
  const std::vector<RayQuery> rays = rays_of(Rays::kIncoherent, run);
  const size_t chunks = chunks_for(rays.size(), kRaysAThreadsChunk);
  SharedRays together(run.ours, rays, chunks, static_cast<size_t>(run.options.threads));
  SharedRays alone(run.ours, rays, chunks, 1);
  const std::vector<Contestant> contestants = {together.contestant("locus"), alone.contestant("one_thread")};
  const auto times = race(contestants, chunks, run.options.rounds, wall_seconds);
  Cell cell;
  cell.suite = "static";
  cell.case_name = name;
  cell.metric = "ns/ray";
  cell.results_hash = hash_of(together.answers());
  add_cells(contestants, times, cell, run.report);
  if (hash_of(alone.answers()) != cell.results_hash)
    run.report.disagreements.push_back(absl::StrCat(name, ": one thread gives other hits than ", run.options.threads));
}

}  // namespace locus::bench
