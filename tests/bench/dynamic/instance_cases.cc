#include "tests/bench/dynamic/instance_cases.h"

#include <atomic>
#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/scene/scene.h"
#include "tests/bench/dynamic/world_run.h"
#include "tests/bench/frame/bar.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/frame/results_hash.h"
#include "tests/bench/frame/statistics.h"
#include "tests/support/owned_block.h"
#include "tests/support/random.h"
#include "tests/support/run_batch.h"

namespace locus::bench::dynamic {
namespace {

using test::Random;

constexpr double kWorld = 1000;  // side of the cube in which instances and objects are
constexpr uint32_t kDoors = 2'000;
constexpr uint32_t kObjects = 10'000;
constexpr Id kFirstObject = 1'000'000;
constexpr double kRequiredTicks = 30;  // in a second

std::shared_ptr<const StaticMesh> tetrahedron() {
  absl::StatusOr<TriangleMesh> mesh =
      TriangleMesh::create({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}, {});
  return *StaticMesh::build("tetrahedron", {}, *std::move(mesh));
}

// Ids and positions of instances or objects.
struct Placed {
  std::vector<uint64_t> ids;
  std::vector<double> positions;

  static Placed random(uint64_t first, uint32_t count, Random& random) {
    Placed placed;
    for (uint32_t i = 0; i < count; ++i) {
      placed.ids.push_back(first + i);
      for (int axis = 0; axis < 3; ++axis) placed.positions.push_back(random.between(0, kWorld));
    }
    return placed;
  }
  // Returns `count` of these, drawn at random and distinct.
  Placed some(uint32_t count, Random& random) const {
    std::vector<uint32_t> order(ids.size());
    for (uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    random.shuffle(order);
    Placed placed;
    for (uint32_t i = 0; i < count; ++i) {
      placed.ids.push_back(ids[order[i]]);
      for (int axis = 0; axis < 3; ++axis) placed.positions.push_back(positions[3 * order[i] + axis]);
    }
    return placed;
  }
  void step(double length) {
    for (size_t i = 0; i < positions.size(); ++i) positions[i] += (i % 2 == 0 ? length : -length);
  }
};

StaticChange placing(const std::shared_ptr<const StaticMesh>& mesh, const Placed& placed) {
  StaticChange change;
  PlacementColumns& place = change.place.emplace_back();
  place.mesh = mesh;
  place.ids = placed.ids;
  place.translations = placed.positions;
  return change;
}

// Applies changes to a scene of its own, and notes those that fail.
class Changes {
 public:
  Changes(const Options& options, Report& report)
      : options_(options), report_(report), mesh_(tetrahedron()), all_(Placed::random(1, count(), random_)) {}

  void run() {
    if (!wanted()) return;
    const double all = seconds([this] {
      scene_ = std::make_unique<Scene>("changes", SceneSpec(), 1, StaticSet::empty());
      change(placing(mesh_, all_));
    });
    for (const uint32_t part : {1u, count() / 100}) {
      const std::string size = part == 1 ? "one" : "1%";
      const double required = part == 1 ? 20 : 10;
      add("move_" + size, all, required, [this, part] {
        Placed some = all_.some(part, random_);
        some.step(0.5);
        return [this, some] {
          UpdateBatch batch;
          InstanceMoveColumns& move = batch.instance_moves.emplace_back();
          move.ids = some.ids;
          move.positions_f64 = some.positions;
          check(scene_->apply(batch).status());
        };
      });
      add("remove_" + size, all, required, [this, part] {
        place_missing();
        missing_ = all_.some(part, random_);
        return [this] { change(removing(missing_)); };
      });
      add("place_" + size, all, required, [this, part] {
        place_missing();
        missing_ = all_.some(part, random_);
        change(removing(missing_));
        return [this] { place_missing(); };
      });
      place_missing();
    }
  }

 private:
  uint32_t count() const { return options_.quick ? 10'000 : 100'000; }
  std::string case_name(const std::string& what) const {
    return absl::StrCat("instances/", what, "/", name_of_count(count()));
  }
  // Returns whether any case is wanted. The scene is not made for nothing.
  bool wanted() const {
    for (const char* what : {"move_one", "move_1%", "remove_one", "remove_1%", "place_one", "place_1%"}) {
      if (options_.filter.wants(case_name(what))) return true;
    }
    return false;
  }
  static StaticChange removing(const Placed& placed) {
    StaticChange change;
    change.remove_ids = placed.ids;
    return change;
  }
  void check(const absl::Status& status) {
    if (!status.ok()) report_.disagreements.push_back(absl::StrCat("instances: ", status.ToString()));
  }
  void change(const StaticChange& change) { check(scene_->change_instances(change).status()); }
  void place_missing() {
    if (!missing_.ids.empty()) change(placing(mesh_, missing_));
    missing_ = {};
  }

  // Returns the median time of `work`.
  template <class Work>
  double seconds(const Work& work) const {
    std::vector<double> times;
    for (int round = 0; round <= options_.rounds; ++round) {
      const double begin = wall_seconds();
      work();
      if (round > 0) times.push_back(wall_seconds() - begin);
    }
    return median(times);
  }
  // Adds a cell for the work that prepare() returns. Only the work is timed.
  template <class Prepare>
  void add(const std::string& what, double all, double required, const Prepare& prepare) {
    const std::string name = case_name(what);
    if (!options_.filter.wants(name)) return;
    std::vector<double> times;
    for (int round = 0; round < options_.rounds; ++round) {
      const auto work = prepare();
      const double begin = wall_seconds();
      work();
      times.push_back(wall_seconds() - begin);
    }
    Cell cell = cell_of(name, "ms", hash_of_number(count()));
    cell.ours = 1e3 * median(times);
    cell.peer = 1e3 * all;
    cell.peer_name = "place_all";
    cell.ratio = all / median(times);
    report_.add(cell);
    note_bar(report_, required);
  }

  const Options& options_;
  Report& report_;
  Random random_{7};
  std::shared_ptr<const StaticMesh> mesh_;
  Placed all_;
  Placed missing_;
  std::unique_ptr<Scene> scene_;
};

// Casts rays at the latest revision until it is told to stop.
class Reader {
 public:
  explicit Reader(const Scene& scene) : thread_([this, &scene] { run(scene); }) {}
  ~Reader() {
    stop_ = true;
    thread_.join();
  }
  uint64_t batches() const { return batches_; }

 private:
  void run(const Scene& scene) {
    Random random(9);
    test::OwnedBlock block;
    block.settings.kind = RayColumns{};
    for (int i = 0; i < 100; ++i) {
      const Vec3d direction = random.unit_vector();
      for (int axis = 0; axis < 3; ++axis) {
        block.points.push_back(random.float_between(0, kWorld));
        block.sizes.push_back(static_cast<float>(direction[axis]));
      }
    }
    for (; !stop_; ++batches_) test::run_block(*scene.latest(), block);
  }

  std::atomic<bool> stop_{false};
  std::atomic<uint64_t> batches_{0};
  std::thread thread_;  // the last member, because it uses the others
};

void run_doors(const Options& options, Report& report) {
  Random random(5);
  SceneSpec spec;
  spec.history = {60, uint64_t{1} << 30};
  Scene scene("doors", spec, 1, StaticSet::empty());
  Placed doors = Placed::random(1, kDoors, random), objects = Placed::random(kFirstObject, kObjects, random);
  const float radius = 0.5f;
  UpdateBatch first;
  InsertColumns& insert = first.inserts.emplace_back();
  insert.ids = objects.ids;
  insert.positions_f64 = objects.positions;
  insert.kind = ShapeKind::kBall;
  insert.radii = {&radius, 1};
  if (!scene.change_instances(placing(tetrahedron(), doors)).ok() || !scene.apply(first).ok())
    return report.disagreements.push_back("doors: the scene was not made");
  const Reader reader(scene);
  const uint64_t ticks = options.quick ? 60 : 600;
  const double begin = wall_seconds();
  for (uint64_t tick = 1; tick <= ticks; ++tick) {
    doors.step(tick % 40 < 20 ? 0.05 : -0.05);
    objects.step(tick % 40 < 20 ? 0.1 : -0.1);
    UpdateBatch batch;
    batch.tick = tick;
    MoveColumns& move = batch.moves.emplace_back();
    move.ids = objects.ids;
    move.positions_f64 = objects.positions;
    InstanceMoveColumns& swing = batch.instance_moves.emplace_back();
    swing.ids = doors.ids;
    swing.positions_f64 = doors.positions;
    const absl::StatusOr<UpdateAck> ack = scene.apply(batch);
    if (!ack.ok() || ack->refused != 0) return report.disagreements.push_back("doors: a batch was refused");
  }
  const double took = wall_seconds() - begin;
  Cell cell = cell_of("doors/1reader", "ticks/s", hash_of_number(kDoors));
  cell.ours = static_cast<double>(ticks) / took;
  cell.peer = kRequiredTicks;
  cell.peer_name = "required";
  cell.ratio = cell.ours / cell.peer;
  report.add(cell);
  note_bar(report, 1);
  report.notes.push_back(absl::StrFormat("doors/1reader: the reader ran %.0f batches of 100 rays in a second",
                                         static_cast<double>(reader.batches()) / took));
}

}  // namespace

void run_instance_cases(const Options& options, const Progress& progress, Report& report) {
  progress("instances");
  Changes(options, report).run();
  if (!options.filter.wants("doors/1reader")) return;
  progress("doors/1reader");
  run_doors(options, report);
}

}  // namespace locus::bench::dynamic
