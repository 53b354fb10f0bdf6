#include "tests/bench/dynamic/compound_cases.h"

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
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

constexpr uint32_t kBodies = 10'000;
constexpr uint32_t kParts = 16;
constexpr uint32_t kQueries = 2'000;
constexpr float kWorld = 200;                  // side of the cube in which the bodies are
constexpr double kRequiredShareOfBall = 0.25;  // a body moves in at most four times the time of a ball

// Scenes of bodies, of balls at the places of the bodies, and of balls at the places of all parts.
class Bodies {
 public:
  Bodies(const Options& options, Report& report) : options_(options), report_(report) {
    for (uint32_t i = 0; i < kBodies; ++i) {
      ids_.push_back(i + 1);
      for (int axis = 0; axis < 3; ++axis) positions_.push_back(random_.float_between(0, kWorld));
    }
    for (uint32_t i = 0; i < kParts; ++i) {
      for (int axis = 0; axis < 3; ++axis) part_positions_.push_back(random_.float_between(-0.5f, 0.5f));
      radii_.push_back(random_.float_between(0.05f, 0.2f));
    }
    for (const uint64_t id : ids_) {
      for (uint32_t part = 0; part < kParts; ++part) {
        part_ids_.push_back(id * kParts + part);
        for (size_t axis = 0; axis < 3; ++axis)
          all_positions_.push_back(double{positions_[3 * (id - 1) + axis]} + double{part_positions_[3 * part + axis]});
        all_radii_.push_back(radii_[part]);
      }
    }
    insert();
  }

  void run() {
    add_moves("move", kRequiredShareOfBall, [](MoveColumns&) {});
    add_moves("turn", kRequiredShareOfBall, [this](MoveColumns& move) { move.rotations = rotations_; });
    add_moves("pose", std::nullopt, [this](MoveColumns& move) {
      move.parts_each = kParts;
      move.part_positions = part_positions_;
    });
    add_queries("ray", rays());
    add_queries("ball", balls());
  }

 private:
  void check(const absl::StatusOr<UpdateAck>& ack) {
    if (!ack.ok() || ack->refused != 0) report_.disagreements.push_back("compounds: a batch was refused");
  }

  void insert() {
    UpdateBatch bodies, balls, parts;
    InsertColumns& body = bodies.inserts.emplace_back();
    body.ids = ids_;
    body.positions = positions_;
    body.kind = ShapeKind::kCompound;
    body.parts.push_back({ShapeKind::kBall, part_positions_, {}, radii_, {}, {}});
    check(bodies_.apply(bodies));
    InsertColumns& ball = balls.inserts.emplace_back();
    ball.ids = ids_;
    ball.positions = positions_;
    ball.kind = ShapeKind::kBall;
    ball.radii = absl::MakeConstSpan(radii_).subspan(0, 1);
    check(balls_.apply(balls));
    InsertColumns& part = parts.inserts.emplace_back();
    part.ids = part_ids_;
    part.positions_f64 = all_positions_;
    part.kind = ShapeKind::kBall;
    part.radii = all_radii_;
    check(parts_.apply(parts));
  }

  double seconds_of(Scene& scene, const UpdateBatch& batch) {
    const double begin = wall_seconds();
    check(scene.apply(batch));
    return wall_seconds() - begin;
  }

  // Adds a cell for moves of all bodies, with the columns that `complete` adds, compared with moves of balls.
  void add_moves(const std::string& what, std::optional<double> required,
                 const std::function<void(MoveColumns&)>& complete) {
    const std::string name = absl::StrCat("compounds/", what, "/", name_of_count(kBodies));
    if (!options_.filter.wants(name)) return;
    std::vector<double> ours, peer;
    std::vector<float> moved = positions_;
    for (int round = 0; round <= options_.rounds; ++round) {
      for (float& x : moved) x += random_.float_between(-0.2f, 0.2f);
      rotations_.clear();
      for (uint32_t i = 0; i < kBodies; ++i) {
        const Quaternion q = random_.rotation();
        rotations_.insert(rotations_.end(), {q.x, q.y, q.z, q.w});
      }
      for (float& x : part_positions_) x += round % 2 == 0 ? 0.01f : -0.01f;
      UpdateBatch balls, bodies;
      MoveColumns& ball = balls.moves.emplace_back();
      ball.ids = ids_;
      ball.positions = moved;
      MoveColumns& body = bodies.moves.emplace_back(ball);
      complete(body);
      const double of_balls = seconds_of(balls_, balls), of_bodies = seconds_of(bodies_, bodies);
      if (round == 0) continue;
      peer.push_back(of_balls);
      ours.push_back(of_bodies);
    }
    Cell cell = cell_of(name, "ns/move", hash_of_number(kBodies));
    cell.ours = 1e9 * median(ours) / kBodies;
    cell.peer = 1e9 * median(peer) / kBodies;
    cell.peer_name = "balls";
    cell.ratio = cell.peer / cell.ours;
    report_.add(cell);
    if (required) note_bar(report_, *required);
  }

  test::OwnedBlock rays() {
    test::OwnedBlock block;
    block.settings.kind = RayColumns{};
    for (uint32_t i = 0; i < kQueries; ++i) {
      const Vec3d direction = random_.unit_vector();
      for (int axis = 0; axis < 3; ++axis) {
        block.points.push_back(random_.float_between(0, kWorld));
        block.sizes.push_back(static_cast<float>(direction[axis]));
      }
    }
    return block;
  }
  test::OwnedBlock balls() {
    test::OwnedBlock block;
    block.settings.kind = BallColumns{{}, {}, StaticDetail::kTriangles};
    for (uint32_t i = 0; i < kQueries; ++i)
      for (int axis = 0; axis < 3; ++axis) block.points.push_back(random_.float_between(0, kWorld));
    block.sizes.push_back(5);
    return block;
  }

  // Adds a cell for queries of the bodies, compared with the same queries of all parts. The rows must be equal.
  void add_queries(const std::string& what, const test::OwnedBlock& block) {
    const std::string name = absl::StrCat("compounds/", what, "/", name_of_count(kBodies));
    if (!options_.filter.wants(name)) return;
    // Moves of earlier cases are undone by inserting the bodies again.
    UpdateBatch clear;
    clear.clear = true;
    for (Scene* scene : {&bodies_, &balls_, &parts_}) check(scene->apply(clear));
    reset_parts();
    insert();
    std::vector<double> ours, peer;
    test::BlockResult of_bodies, of_parts;
    for (int round = 0; round <= options_.rounds; ++round) {
      double begin = wall_seconds();
      of_bodies = test::run_block(*bodies_.latest(), block);
      const double first = wall_seconds() - begin;
      begin = wall_seconds();
      of_parts = test::run_block(*parts_.latest(), block);
      const double second = wall_seconds() - begin;
      if (round == 0) continue;
      ours.push_back(first);
      peer.push_back(second);
    }
    for (size_t row = 0; row < of_parts.ids.size(); ++row) {
      if (of_parts.ids[row] == kNoId) continue;
      of_parts.triangles[row] = static_cast<uint32_t>(of_parts.ids[row] % kParts);
      of_parts.ids[row] /= kParts;
    }
    if (std::string difference = test::difference(of_bodies, of_parts); !difference.empty())
      report_.disagreements.push_back(absl::StrCat(name, ": ", difference));
    Cell cell = cell_of(name, "ns/query", hash_of_number(of_bodies.ids.size()));
    cell.ours = 1e9 * median(ours) / kQueries;
    cell.peer = 1e9 * median(peer) / kQueries;
    cell.peer_name = "parts";
    cell.ratio = cell.peer / cell.ours;
    report_.add(cell);
  }
  // Sets the parts to the poses of the scene of all parts, exactly.
  void reset_parts() {
    for (size_t body = 0; body < kBodies; ++body)
      for (size_t i = 0; i < size_t{3} * kParts; ++i)
        all_positions_[body * 3 * kParts + i] = double{positions_[3 * body + i % 3]} + double{part_positions_[i]};
  }

  const Options& options_;
  Report& report_;
  Random random_{11};
  std::vector<uint64_t> ids_, part_ids_;
  std::vector<float> positions_, part_positions_, radii_, all_radii_, rotations_;
  std::vector<double> all_positions_;
  Scene bodies_{"bodies", SceneSpec(), 1, StaticSet::empty()};
  Scene balls_{"balls", SceneSpec(), 1, StaticSet::empty()};
  Scene parts_{"parts", SceneSpec(), 1, StaticSet::empty()};
};

}  // namespace

void run_compound_cases(const Options& options, const Progress& progress, Report& report) {
  progress("compounds");
  Bodies(options, report).run();
}

}  // namespace locus::bench::dynamic
