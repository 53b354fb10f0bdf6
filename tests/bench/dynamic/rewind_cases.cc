#include "tests/bench/dynamic/rewind_cases.h"

#include <algorithm>
#include <array>
#include <map>

#include "absl/strings/str_format.h"
#include "tests/bench/dynamic/query_cases.h"
#include "tests/bench/frame/race.h"

namespace locus::bench::dynamic {
namespace {

constexpr std::array<uint32_t, 3> kAges = {1, 10, 30};  // age of a recorded tick: ticks before the present
constexpr float kFraction = 0.5f;                       // queried time: this many ticks after a recorded tick
constexpr uint32_t kTicks = 32;  // number of ticks that run before the queries, all kept in the history
constexpr uint64_t kHistoryBytes = uint64_t{8} << 30;
constexpr size_t kCalls = 10;     // number of batches into which the queries are divided
constexpr size_t kChecked = 100;  // maximum number of queries that brute force verifies

std::string name_of_age(uint32_t age) { return absl::StrCat(age, age == 1 ? "tick" : "ticks"); }
std::string name_of_case(uint32_t age, uint32_t count) {
  return absl::StrCat("rewind/", name_of_age(age), "/", name_of_count(count));
}

// A world whose history locus stores. For the ticks around the times of the queries, this class also keeps lists of all
// positions.
class PastWorld {
 public:
  explicit PastWorld(uint32_t count)
      : world_(Kind::kUniform, count), queries_(queries_of(world_)), ours_({kTicks, kHistoryBytes}) {
    ours_.load(world_.objects());
    for (uint32_t tick = 1; tick <= kTicks; ++tick) {
      world_.step();
      ours_.move(world_.moves());
      const absl::Span<const float> positions = world_.objects().positions;
      if (is_asked(kTicks - tick)) positions_[kTicks - tick].assign(positions.begin(), positions.end());
    }
  }

  const std::vector<Vec3f>& centers() const { return queries_.centers; }
  const Ours& ours() const { return ours_; }
  uint32_t count() const { return world_.count(); }
  static AsOf time(uint32_t age) { return {kTicks - age, kFraction}; }

  // Returns, in ascending order, the ids of the objects that intersected the ball of kReach around `center` at
  // time(age). Tests all objects.
  std::vector<uint64_t> truth(Vec3f center, uint32_t age) const {
    const std::vector<float>&at = positions_.at(age), &next = positions_.at(age - 1);
    const Objects objects = world_.objects();
    std::vector<uint64_t> ids;
    for (size_t i = 0; i < objects.ids.size(); ++i) {
      const Vec3d from = to_double(point_at(at, i)), to = to_double(point_at(next, i));
      Shape shape;
      shape.kind = ShapeKind::kBall;
      shape.position = from + (to - from) * double{kFraction};
      shape.radius = objects.radii[i];
      if (ball_overlaps(Balld{to_double(center), kReach}, shape)) ids.push_back(objects.ids[i]);
    }
    std::sort(ids.begin(), ids.end());
    return ids;
  }

 private:
  static bool is_asked(uint32_t age) {
    return std::any_of(kAges.begin(), kAges.end(), [age](uint32_t asked) { return age == asked || age + 1 == asked; });
  }

  World world_;
  Queries queries_;
  Ours ours_;
  std::map<uint32_t, std::vector<float>> positions_;  // positions of all objects, by age
};

class Rewinding {
 public:
  Rewinding(const Options& options, uint32_t count, Report& report)
      : options_(options), report_(report), past_(count), now_(batches_of(past_.ours())) {
    for (const uint32_t age : kAges) rewound_.push_back(batches_of(past_.ours(), PastWorld::time(age)));
  }

  void run() {
    std::vector<Contestant> contestants;
    for (size_t i = 0; i < kAges.size(); ++i) {
      check(kAges[i], *rewound_[i]);
      contestants.push_back(contestant(name_of_age(kAges[i]), *rewound_[i]));
    }
    contestants.push_back(contestant("now", *now_));
    const auto times = race(contestants, 1, options_.rounds, thread_seconds);
    for (size_t i = 0; i < kAges.size(); ++i) {
      const std::string name = name_of_case(kAges[i], past_.count());
      if (!options_.filter.wants(name)) continue;
      add_cells({contestants[i], contestants.back()}, {times[i], times.back()}, cell_of(name, "ns/query", hashes_[i]),
                report_);
    }
    const SceneStatus status = past_.ours().status();
    const double bytes = static_cast<double>(status.history_bytes) / past_.count() / status.recorded_ticks;
    report_.notes.push_back(absl::StrFormat("rewind/%s: the past takes %.1f bytes an object and tick, the present %.1f",
                                            name_of_count(past_.count()), bytes,
                                            static_cast<double>(status.memory_bytes) / past_.count()));
  }

 private:
  // Returns the number of passes over all queries in a turn. A single pass would mostly measure reloading the caches,
  // which the other contestants have filled with their data.
  size_t passes() const { return options_.quick ? 1 : 5; }

  Contestant contestant(const std::string& name, Contender& contender) {
    const auto run = [this, &contender](size_t) {
      for (size_t call = 0; call < passes() * kCalls; ++call) {
        answers_.clear();
        contender.balls(part_of(call % kCalls), answers_);
      }
    };
    return {name, run, static_cast<double>(past_.centers().size() * passes()), {}};
  }
  absl::Span<const Vec3f> part_of(size_t call) const {
    const size_t size = past_.centers().size() / kCalls;
    return absl::MakeConstSpan(past_.centers()).subspan(call * size, size);
  }

  void check(uint32_t age, Contender& contender) {
    answers_.clear();
    contender.balls(past_.centers(), answers_);
    hashes_.push_back(hash_of(answers_));
    auto next = answers_.ids.begin();
    for (size_t i = 0; i < (options_.quick ? kChecked / 10 : kChecked); ++i) {
      std::vector<uint64_t> found(next, next + answers_.counts[i]);
      next += answers_.counts[i];
      std::sort(found.begin(), found.end());
      if (found == past_.truth(past_.centers()[i], age)) continue;
      report_.disagreements.push_back(
          absl::StrCat(name_of_case(age, past_.count()), ": the past is wrong in query ", i));
      return;
    }
  }

  const Options& options_;
  Report& report_;
  PastWorld past_;
  std::unique_ptr<Contender> now_;
  std::vector<std::unique_ptr<Contender>> rewound_;
  std::vector<std::string> hashes_;  // hash of the answers of each of rewound_
  Answers answers_;
};

bool wants_any(const Options& options, uint32_t count) {
  if (count == 1'000'000 && options.filter.wants_every()) return false;
  return std::any_of(kAges.begin(), kAges.end(),
                     [&](uint32_t age) { return options.filter.wants(name_of_case(age, count)); });
}

}  // namespace

void run_rewind_cases(const Options& options, const Progress& progress, Report& report) {
  for (const uint32_t count : {10'000, 100'000, 1'000'000}) {
    if ((options.quick && count != 10'000) || !wants_any(options, count)) continue;
    progress(absl::StrCat("rewind/", name_of_count(count)));
    Rewinding(options, count, report).run();
  }
}

}  // namespace locus::bench::dynamic
