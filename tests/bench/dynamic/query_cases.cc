#include "tests/bench/dynamic/query_cases.h"

#include <algorithm>
#include <numeric>

#include "tests/bench/dynamic/agreement.h"
#include "tests/bench/dynamic/check_values.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/frame/results_hash.h"

namespace locus::bench::dynamic {
namespace {

// Number of calls into which the queries are divided. For a contender that runs batches, a call is one batch.
constexpr size_t kParts = 10;

struct QueryCase {
  const char* name;
  const char* batch_name;
  Task task;
};
constexpr QueryCase kCases[] = {{"ball", "ball_batch", Task::kBall},
                                {"box", "box_batch", Task::kBox},
                                {"ray", "ray_batch", Task::kRay},
                                {"nearest", "nearest_batch", Task::kNearest}};

// Returns the queries of one of kParts calls.
template <class T>
absl::Span<const T> part_of(const std::vector<T>& queries, size_t part) {
  const size_t begin = queries.size() * part / kParts, end = queries.size() * (part + 1) / kParts;
  return absl::MakeConstSpan(queries).subspan(begin, end - begin);
}

void ask(Contender& contender, Task task, const Queries& queries, size_t part, Answers& answers) {
  if (task == Task::kBall) contender.balls(part_of(queries.centers, part), answers);
  if (task == Task::kBox) contender.boxes(part_of(queries.centers, part), answers);
  if (task == Task::kRay) contender.rays(part_of(queries.rays, part), answers);
  if (task == Task::kNearest) contender.nearest(part_of(queries.centers, part), answers);
}

void ask_all(Contender& contender, Task task, const Queries& queries, Answers& answers) {
  for (size_t part = 0; part < kParts; ++part) ask(contender, task, queries, part, answers);
}

class QueryRace {
 public:
  QueryRace(const WorldRun& run, const QueryCase& query_case) : run_(run), case_(query_case) {
    batches_ = batches_of(run.ours);
    for (const Entrant& entrant : run.entrants) {
      if (entrant.contender->does(case_.task)) enter(*entrant.contender);
      if (entries_.size() == 1) enter(*batches_);
    }
  }

  void run() {
    compare_all();
    std::vector<Contestant> contestants;
    for (const Entry& entry : entries_) contestants.push_back(contestant(entry));
    const auto times = race(contestants, 1, run_.options.rounds, thread_seconds);
    add(case_.name, contestants, times, 1);
    add(case_.batch_name, contestants, times, 0);
  }

 private:
  // Work of one contender in a turn: `parts` calls. A fast contender makes several passes over all queries, since a
  // single pass would mostly measure reloading the caches, which the other contenders have filled with their data. A
  // slow contender makes less than one pass.
  struct Entry {
    Contender* contender = nullptr;
    size_t parts = 1;
  };

  void enter(Contender& contender) { entries_.push_back({&contender, 1}); }

  void compare_all() {
    const std::string name = run_.case_of(case_.name);
    Answers ours, theirs;
    ask_all(*entries_.front().contender, case_.task, run_.queries, ours);
    hash_ = hash_of(ours);
    for (Entry& entry : entries_) {
      theirs.clear();
      const double start = thread_seconds();
      ask_all(*entry.contender, case_.task, run_.queries, theirs);
      entry.parts = parts_of(thread_seconds() - start);
      const std::string& contender = entry.contender->name();
      compare(name, case_.task, run_.world, run_.queries, ours, contender, theirs, run_.report);
      check_values(name, case_.task, run_.world, run_.queries, contender, theirs, run_.report);
    }
  }

  // Returns the number of calls in a turn of a contender whose kParts calls take `seconds`.
  size_t parts_of(double seconds) const {
    const double turn = run_.options.quick ? 0.002 : 0.1;
    return static_cast<size_t>(std::clamp(kParts * turn / seconds, 1.0, 5.0 * kParts));
  }

  Contestant contestant(const Entry& entry) {
    size_t count = 0;
    for (size_t i = 0; i < entry.parts; ++i) count += part_of(run_.queries.centers, i % kParts).size();
    const auto run_turn = [this, &entry](size_t) {
      for (size_t i = 0; i < entry.parts; ++i) {
        answers_.clear();
        ask(*entry.contender, case_.task, run_.queries, i % kParts, answers_);
      }
    };
    return {entry.contender->name(), run_turn, static_cast<double>(count), {}};
  }

  // Adds cells for all contestants except contestant `out`. Contestants 0 and 1 are both locus, one with single queries
  // and one with batches; `out` is one of these two.
  void add(const char* name, std::vector<Contestant> contestants, std::vector<std::vector<double>> times, size_t out) {
    if (!run_.options.filter.wants(run_.case_of(name))) return;
    contestants.erase(contestants.begin() + static_cast<ptrdiff_t>(out));
    times.erase(times.begin() + static_cast<ptrdiff_t>(out));
    add_cells(contestants, times, cell_of(run_.case_of(name), "ns/query", hash_), run_.report);
  }

  const WorldRun& run_;
  const QueryCase& case_;
  std::unique_ptr<Contender> batches_;
  std::vector<Entry> entries_;
  Answers answers_;
  std::string hash_;
};

}  // namespace

std::string hash_of(const Answers& answers) {
  ResultsHash hash;
  auto next = answers.ids.begin();
  for (const uint32_t count : answers.counts) {
    hash.add(count);
    hash.add(std::accumulate(next, next + count, uint64_t{0}));
    next += count;
  }
  return hash.text();
}

std::string compare_some_balls(const WorldRun& run, const std::string& case_name) {
  Queries some = run.queries;
  some.centers.resize(some.centers.size() / 10);
  Answers ours, theirs;
  for (const Entrant& entrant : run.entrants) {
    if (!entrant.contender->does(Task::kBall)) continue;
    Answers& answers = ours.counts.empty() ? ours : theirs;
    answers.clear();
    ask_all(*entrant.contender, Task::kBall, some, answers);
    if (&answers == &theirs)
      compare(case_name, Task::kBall, run.world, some, ours, entrant.contender->name(), theirs, run.report);
  }
  return hash_of(ours);
}

void run_query_cases(const WorldRun& run) {
  for (const QueryCase& one : kCases) {
    const CaseFilter& filter = run.options.filter;
    if (filter.wants(run.case_of(one.name)) || filter.wants(run.case_of(one.batch_name))) QueryRace(run, one).run();
  }
}

}  // namespace locus::bench::dynamic
