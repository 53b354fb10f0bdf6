// Comparison between a scene with history and a model that keeps every tick in full. The test inserts, moves,
// teleports, relabels and removes objects at random, and queries the scene at random times. It compares every column of
// the answers bit for bit, with every instruction set, on one and two threads, and in the brute-force mode. A tick has
// one batch or several batches, in which the same object can move far and back, be replaced, teleport, be removed and
// be inserted again. Used by the random tests, which expect no difference, and by the tests of planted bugs, which
// expect a difference.
//
// Before commit 476c028, the trials did not detect PlantedBug::kRewindFastBox: with this bug, a rewind misses an object
// that moves twice in one tick. Ticks had several batches, but an object rarely moved far in one batch and back near
// its start in a later batch. Also, all queries aimed at current positions, and none at the positions that objects had
// at the queried time between two ticks.
#ifndef LOCUS_TESTS_SUPPORT_REWIND_LOCKSTEP_H_
#define LOCUS_TESTS_SUPPORT_REWIND_LOCKSTEP_H_

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "core/base/instruction_set.h"
#include "core/scene/scene.h"
#include "tests/support/columns.h"
#include "tests/support/owned_block.h"
#include "tests/support/query_oracle.h"
#include "tests/support/random.h"
#include "tests/support/random_compound.h"
#include "tests/support/scene_model.h"
#include "tests/support/threads.h"

namespace locus::test {

namespace internal {

template <class Column>
void append_column(const Column& from, Column& to) {
  to.insert(to.end(), from.begin(), from.end());
}

// Appends `from`, the answer to query `query`, to `to`, which contains the answers to all queries before this query.
inline void append_answer(const BlockResult& from, uint32_t query, BlockResult& to) {
  append_column(from.counts, to.counts);
  for (size_t i = 0; i < from.truncated.size(); ++i) to.truncated.push_back(query);
  append_column(from.hits, to.hits);
  append_column(from.t, to.t);
  append_column(from.ids, to.ids);
  append_column(from.triangles, to.triangles);
  append_column(from.uvs, to.uvs);
  append_column(from.normals, to.normals);
  append_column(from.points, to.points);
  append_column(from.groups, to.groups);
  append_column(from.tags, to.tags);
  append_column(from.layers, to.layers);
  append_column(from.positions, to.positions);
  append_column(from.rotations, to.rotations);
}

}  // namespace internal

class RewindLockstep {
 public:
  // Makes a scene whose objects start within `world` of the origin on each axis and move by about `step` per batch;
  // sometimes an object moves much farther. A batch begins a tick with the probability `new_tick`.
  RewindLockstep(uint64_t seed, double world, double step, double new_tick)
      : random_(seed),
        world_(world),
        step_(step),
        new_tick_(new_tick),
        history_ticks_(1 + random_.below(12)),
        model_(history_ticks_),
        scene_("rewind", spec(), 1, StaticSet::empty()) {}

  // Returns the first difference; empty if there is none.
  std::string run(int batches) {
    for (int number = 0; number < batches; ++number) {
      std::string what = apply_batch();
      if (what.empty() && random_.chance(0.5)) what = ask();
      if (!what.empty()) return "batch " + std::to_string(number) + ": " + what;
    }
    return "";
  }

 private:
  static constexpr uint64_t kIds = 400;
  static constexpr uint32_t kParts = 3;  // parts of each compound

  SceneSpec spec() const {
    SceneSpec spec;
    spec.history = {static_cast<uint32_t>(history_ticks_), uint64_t{1} << 40};
    return spec;
  }

  std::vector<uint64_t> some_ids(double share) {
    std::vector<uint64_t> ids;
    for (uint64_t id = 1; id <= kIds; ++id)
      if (random_.chance(share)) ids.push_back(id);
    return ids;
  }

  // Returns the next position of an object; sometimes a position close to that at the beginning of the tick.
  Vec3d step_from(Id id, Vec3d place) {
    if (random_.chance(0.25))
      return model_.position_at_last_tick(id).value_or(place) + random_.vector(step_ * (random_.chance(0.5) ? 8 : 1));
    if (random_.chance(0.01)) return random_.vector(world_);
    if (random_.chance(0.05)) return place;
    if (!random_.chance(0.05)) return place + random_.vector(step_);
    far_ids_[next_far_++ % far_ids_.size()] = id;
    return place + random_.vector(step_ * 40);
  }

  MoveColumns moves(double share, bool teleport) {
    MoveColumns move;
    std::vector<double> positions;
    std::vector<float> rotations;
    const std::vector<uint64_t> ids = some_ids(share);
    for (const uint64_t id : ids) {
      const auto known = model_.objects().find(id);
      const Vec3d place =
          known == model_.objects().end() ? random_.vector(world_) : step_from(id, known->second.shape.position);
      positions.insert(positions.end(), {place.x, place.y, place.z});
      const Quaternion q = random_.rotation();
      rotations.insert(rotations.end(), {q.x, q.y, q.z, q.w});
    }
    move.ids = columns_.ids(ids);
    move.positions_f64 = columns_.doubles(std::move(positions));
    if (random_.chance(0.3)) move.rotations = columns_.floats(std::move(rotations));
    move.teleport = teleport;
    if (random_.chance(0.2)) {  // new poses of parts, for all objects or for each
      move.parts_each = kParts;
      std::vector<float> places;
      for (size_t i = (random_.chance(0.5) ? 1 : ids.size()) * kParts; i > 0; --i)
        append(places, random_.float_vector(random_.chance(0.1) ? 30 : 2));
      move.part_positions = columns_.floats(std::move(places));
      if (ids.empty()) move.parts_each = 0, move.part_positions = {};
    }
    return move;
  }

  InsertColumns births(double share) {
    InsertColumns insert;
    const std::vector<uint64_t> ids = some_ids(share);
    std::vector<double> positions;
    std::vector<uint64_t> groups;
    for (const uint64_t id : ids) {
      const Vec3d place = step_from(id, random_.vector(world_));
      positions.insert(positions.end(), {place.x, place.y, place.z});
      groups.push_back(random_.below(4));
    }
    insert.ids = columns_.ids(ids);
    insert.positions_f64 = columns_.doubles(std::move(positions));
    insert.groups = columns_.ids(std::move(groups));
    std::vector<uint64_t> expire_ticks;
    for (size_t i = 0; i < ids.size(); ++i) expire_ticks.push_back(random_.chance(0.7) ? 0 : random_.below(8));
    if (random_.chance(0.5)) insert.expire_ticks = columns_.ids(std::move(expire_ticks));
    insert.kind = static_cast<ShapeKind>(random_.below(5));
    if (insert.kind == ShapeKind::kCompound) add_parts(insert);
    insert.radii = columns_.floats({random_.float_between(0, 2)});
    insert.extents = columns_.floats({random_.float_between(0, 2), random_.float_between(0, 1), 0.5f});
    return insert;
  }

  void add_parts(InsertColumns& insert) {
    for (uint32_t i = 0; i < kParts; ++i) {
      const Part part = random_part(random_, 1);
      PartColumns columns;
      columns.kind = part.kind;
      columns.positions = columns_.floats({part.position.x, part.position.y, part.position.z});
      columns.rotations = columns_.floats({part.rotation.x, part.rotation.y, part.rotation.z, part.rotation.w});
      columns.radii = columns_.floats({part.radius});
      columns.extents = columns_.floats({part.size.x, part.size.y, part.size.z});
      insert.parts.push_back(columns);
    }
  }

  // Generates a batch. Most batches contain only moves, and most of these batches move every object.
  UpdateBatch draw() {
    UpdateBatch batch;
    if (random_.chance(new_tick_)) batch.tick = model_.tick() + (random_.chance(0.2) ? random_.below(6) : 1);
    const double share = random_.chance(0.6) ? 1 : random_.unit() * 0.2;
    batch.moves.push_back(moves(share, false));
    if (random_.chance(0.5)) return batch;
    batch.upsert = random_.chance(0.3);
    batch.restart_ticks = random_.chance(0.02);
    batch.clear = random_.chance(0.01);
    if (random_.chance(0.5)) batch.remove_ids = columns_.ids(some_ids(0.05));
    if (random_.chance(0.1)) batch.remove_groups = columns_.ids({1 + random_.below(3)});
    if (random_.chance(0.5)) batch.inserts.push_back(births(random_.chance(0.3) ? 0.9 : 0.1));
    if (random_.chance(0.3)) batch.moves.push_back(moves(0.1, true));
    if (random_.chance(0.2)) batch.moves.push_back(moves(0.1, false));
    if (random_.chance(0.3)) {
      RelabelColumns relabel;
      relabel.ids = columns_.ids(some_ids(0.1));
      relabel.tags = columns_.ids({random_.next()});
      batch.relabels.push_back(relabel);
    }
    return batch;
  }

  std::string apply_batch() {
    columns_ = Columns();
    UpdateBatch batch = draw();
    if (model_.objects().empty()) batch.inserts.push_back(births(1));
    const absl::StatusOr<UpdateAck> ack = scene_.apply(batch);
    const SceneModel::Outcome expected = model_.apply(batch);
    if (!ack.ok()) return ack.status().ToString();
    if (ack->revision != expected.ack.revision || ack->tick != expected.ack.tick) return "revision or tick of the ack";
    const SnapshotPtr snapshot = scene_.latest();
    if (snapshot->oldest_tick() != model_.oldest_tick()) return "oldest tick";
    if (scene_.status().recorded_ticks != model_.recorded_ticks()) return "number of recorded ticks";
    return "";
  }

  // Returns a random object, often one that moved far recently, because queries search separately for objects that
  // moved far.
  const Object& some_object(const std::vector<Object>& objects) {
    const Id far = random_.pick(far_ids_);
    const auto at =
        std::find_if(objects.begin(), objects.end(), [far](const Object& object) { return object.id == far; });
    return at == objects.end() || random_.chance(0.3) ? random_.pick(objects) : *at;
  }

  // Returns a position near an object, either a current object or an object at the time of query `i` of the block.
  Vec3d place(const OwnedBlock& block, size_t i) {
    if (model_.objects().empty()) return {};
    if (random_.chance(0.5)) {
      const uint64_t tick = block.as_of_ticks[i % block.as_of_ticks.size()];
      const auto& fractions = block.as_of_fractions;
      const auto then = model_.objects_at(tick, fractions.empty() ? 0 : fractions[i % fractions.size()]);
      if (then && !then->empty()) return some_object(*then).shape.position + random_.vector(step_ / 2);
    }
    auto at = model_.objects().begin();
    std::advance(at, static_cast<std::ptrdiff_t>(random_.below(model_.objects().size())));
    return at->second.shape.position + random_.vector(step_ * 2);
  }

  OwnedBlock draw_block() {
    OwnedBlock block;
    const size_t n = 1 + random_.below(5);
    const uint64_t kind = random_.below(6);
    if (kind == 0) block.settings.kind = BallColumns{};
    if (kind == 1) block.settings.kind = BoxColumns{};
    if (kind == 2) block.settings.kind = RayColumns{{}, {}, {}, static_cast<RayMode>(random_.below(3))};
    if (kind == 3 || kind == 4) block.settings.kind = LookupColumns{};
    if (kind == 5) block.settings.kind = NearestColumns{{}, {}, static_cast<uint32_t>(1 + random_.below(4))};
    draw_times(n, block);
    const double size = random_.chance(0.5) ? 4 * step_ : step_ / 2;
    for (size_t i = 0; i < n; ++i) {
      if (kind == 3) block.ids.push_back(1 + random_.below(kIds));
      if (kind == 4) block.groups.push_back(1 + random_.below(3));
      if (kind < 3 || kind == 5) append(block.points, to_float(place(block, i)));
      if (kind == 0) block.sizes.push_back(random_.float_between(0, size));
      if (kind == 1) append(block.sizes, to_float(random_.positive_vector(size)));
      if (kind == 2) append(block.sizes, random_.float_vector(1));
    }
    add_settings(kind, block);
    return block;
  }
  static void append(std::vector<float>& to, Vec3f v) { to.insert(to.end(), {v.x, v.y, v.z}); }

  void add_settings(uint64_t kind, OwnedBlock& block) {
    const bool any = kind == 2 && std::get<RayColumns>(block.settings.kind).mode == RayMode::kAny;
    if (kind != 3 && kind != 4 && random_.chance(0.2)) block.settings.precision = Precision::kConservative;
    if (random_.chance(0.3)) block.settings.max_results = 3;
    if (!any)
      for (const Column column : {Column::kId, Column::kTag, Column::kPose}) block.settings.columns.add(column);
    if (kind == 2 && !any) block.settings.columns.add(Column::kNormal);
    if ((kind < 3 || kind == 5) && !any) block.settings.columns.add(Column::kTriangle);
    if ((kind == 2 && !any) || kind == 5) block.settings.columns.add(Column::kT);
    if (kind == 5) block.settings.columns.add(Column::kPoint);
  }

  // Generates one time for all `n` queries, or one time for each query.
  void draw_times(size_t n, OwnedBlock& block) {
    block.settings.outside = OutsideHistory::kClamp;
    const uint64_t oldest = model_.oldest_tick(), ticks = model_.tick() - oldest;
    const bool one = random_.chance(0.3);
    for (size_t i = 0; i < (one ? 1 : n); ++i)
      block.as_of_ticks.push_back(random_.chance(0.05) ? random_.below(2 * model_.tick() + 2)
                                                       : oldest + random_.below(ticks + 1));
    if (!random_.chance(0.7)) return;
    for (size_t i = 0; i < (one ? 1 : n); ++i)
      block.as_of_fractions.push_back(random_.chance(0.3) ? 0.5f : static_cast<float>(random_.unit() * 0.99));
  }

  BlockResult expected_answer(const SceneSnapshot& snapshot, const OwnedBlock& block) const {
    BlockResult expected;
    const size_t n = query_count(block.view());
    for (size_t i = 0; i < n; ++i) {
      const OwnedBlock one = block.part(i, i + 1);
      const uint64_t asked = one.as_of_ticks[0];
      const float fraction = one.as_of_fractions.empty() ? 0 : one.as_of_fractions[0];
      auto objects = model_.objects_at(asked, fraction);
      const uint64_t tick = objects ? asked : asked < model_.oldest_tick() ? model_.oldest_tick() : model_.tick();
      expected.resolved_ticks.push_back(tick);
      expected.resolved_fractions.push_back(objects ? fraction : 0);
      if (!objects) expected.clamped.push_back(static_cast<uint32_t>(i));
      if (!objects) objects = model_.objects_at(tick, 0);
      internal::append_answer(QueryOracle(snapshot, *objects).answer(one.view()), static_cast<uint32_t>(i), expected);
    }
    return expected;
  }

  std::string ask() {
    std::vector<OwnedBlock> blocks;
    for (int i = 0; i < 4; ++i) blocks.push_back(draw_block());
    const QueryBatch batch = batch_of(blocks);
    if (const absl::Status status = check_batch(batch); !status.ok()) return status.ToString();
    const SnapshotPtr snapshot = scene_.latest();
    BatchResult expected;
    for (const OwnedBlock& block : blocks) expected.blocks.push_back(expected_answer(*snapshot, block));
    RunOptions brute_force;
    brute_force.brute_force = true;
    const std::pair<RunOptions, ParallelFor> ways[] = {{{}, {}}, {brute_force, {}}, {{}, on_threads(2)}};
    for (const auto& [options, parallel_for] : ways) {
      for (const std::string& set : instruction_sets()) {
        LOCUS_CHECK(use_instruction_set(set).ok());
        const absl::StatusOr<BatchResult> got = run_batch(*snapshot, batch, options, parallel_for);
        LOCUS_CHECK(use_instruction_set("").ok());
        if (!got.ok()) return got.status().ToString();
        if (std::string what = difference(*got, expected); !what.empty()) return set + ": " + what;
      }
    }
    return "";
  }

  Random random_;
  double world_, step_, new_tick_;
  uint64_t history_ticks_;
  std::array<Id, 32> far_ids_{};  // ids of the objects that moved far most recently
  size_t next_far_ = 0;
  SceneModel model_;
  Scene scene_;
  Columns columns_;
};

// Probabilities that a batch begins a tick: with kTicksOfOneBatch most ticks have one batch, with kTicksOfManyBatches
// most ticks have several batches.
constexpr double kTicksOfOneBatch = 0.7, kTicksOfManyBatches = 0.25;

// Returns the first difference over `count` scenes of `batches` batches each; empty if there is none.
inline std::string search_rewind_lockstep(uint64_t count, int batches, double new_tick = kTicksOfOneBatch) {
  for (uint64_t seed = 0; seed < count; ++seed) {
    const double step = std::exp2(static_cast<double>(seed % 7) - 3);
    const double world = seed % 2 == 0 ? 100 : 20;
    const std::string what = RewindLockstep(seed, world, step, new_tick).run(batches);
    if (!what.empty()) return "seed " + std::to_string(seed) + ", " + what;
  }
  return "";
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_REWIND_LOCKSTEP_H_
