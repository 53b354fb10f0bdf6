// Random update batches of valid form, which sometimes contain wrong items of every kind. Ids, groups and writers come
// from small pools, so that duplicates, unknown ids and repeated batches are frequent.
#ifndef LOCUS_TESTS_SUPPORT_RANDOM_UPDATES_H_
#define LOCUS_TESTS_SUPPORT_RANDOM_UPDATES_H_

#include <limits>
#include <map>
#include <vector>

#include "core/base/limits.h"
#include "core/scene/updates/update_batch.h"
#include "tests/support/columns.h"
#include "tests/support/random.h"

namespace locus::test {

class RandomUpdates {
 public:
  // Makes a generator whose ids are below `ids`.
  RandomUpdates(Random& random, uint64_t ids) : random_(random), ids_(ids) {}

  // Generates a batch with lists of at most `items` entries, sometimes as several messages. The batch borrows its
  // columns from `columns`.
  UpdateBatch draw(Columns& columns, size_t items) {
    UpdateBatch batch = draw_message(columns, items);
    batch.all_or_nothing = random_.chance(0.15);
    batch.restart_ticks = random_.chance(0.05);
    if (random_.chance(0.4)) batch.tick = random_.below(50);
    if (random_.chance(0.3)) number(batch);
    if (batch.writer != 0 && random_.chance(0.3)) batch.lease_ms = static_cast<uint32_t>(1 + random_.below(3));
    if (random_.chance(0.15))
      for (uint64_t i = 1 + random_.below(3); i > 0; --i) batch.earlier.push_back(draw_message(columns, items));
    return batch;
  }

  // Generates a writer id, often one whose lease a batch has begun.
  uint64_t draw_writer() { return 1 + random_.below(3) + 3 * (drawn_ / 100); }

 private:
  static constexpr size_t kParts = 3;  // usual number of parts of a compound
  static constexpr Vec3d kFrames[] = {{}, {}, {1e6, -3, 0.1}, {-5e8, 5e8, 1e9}};

  // Generates the columns of a batch, and the settings that each message has.
  UpdateBatch draw_message(Columns& columns, size_t items) {
    UpdateBatch batch;
    batch.frame = random_.pick(kFrames);
    batch.clear = random_.chance(0.03);
    batch.upsert = random_.chance(0.3);
    if (random_.chance(0.3)) batch.remove_ids = columns.ids(draw_ids(1 + random_.below(items)));
    if (random_.chance(0.1)) batch.remove_groups = columns.ids(draw_labels<uint64_t>(2));
    for (uint64_t i = random_.below(4); i > 0; --i) batch.inserts.push_back(draw_insert(columns, items));
    for (uint64_t i = random_.below(4); i > 0; --i) batch.moves.push_back(draw_move(columns, items));
    for (uint64_t i = random_.below(2); i > 0; --i) batch.relabels.push_back(draw_relabel(columns, items));
    for (uint64_t i = random_.below(3); i > 1; --i) batch.instance_moves.push_back(draw_instance_move(columns, items));
    if (random_.chance(0.1)) batch.instance_relabels.push_back(draw_relabel(columns, items));
    return batch;
  }

  std::vector<uint64_t> draw_ids(size_t count) {
    std::vector<uint64_t> ids(count);
    for (uint64_t& id : ids) id = random_.below(ids_);
    return ids;
  }

  template <class T>
  std::vector<T> draw_labels(size_t count) {
    std::vector<T> labels(count);
    for (T& label : labels) label = static_cast<T>(random_.below(5));
    return labels;
  }

  // Generates one value for each of n items, or one value for all items.
  template <class T, class Draw>
  std::vector<T> draw_column(size_t n, const Draw& draw) {
    std::vector<T> numbers;
    for (size_t i = random_.chance(0.3) ? 1 : n; i > 0; --i)
      for (const double value : draw()) numbers.push_back(static_cast<T>(random_.chance(0.003) ? bad_number() : value));
    return numbers;
  }

  double bad_number() {
    constexpr double kBad[] = {std::numeric_limits<double>::quiet_NaN(),
                               std::numeric_limits<double>::infinity(),
                               -std::numeric_limits<double>::infinity(),
                               -2e9,
                               2e9,
                               -0.5};
    return random_.pick(kBad);
  }

  // Generates a position, often one that other objects have too.
  std::vector<double> draw_position() {
    const Vec3d p = random_.chance(0.7) ? random_.whole_vector(3) * 8 : random_.vector(random_.magnitude(0, 12));
    return {p.x, p.y, p.z};
  }
  std::vector<double> draw_size() {
    const double scale = random_.magnitude(-4, 8);
    return {random_.between(0, scale), random_.between(0, scale), random_.chance(0.2) ? 0 : scale};
  }
  std::vector<double> draw_rotation() {
    const Quaternion q = random_.rotation();
    const double length = random_.chance(0.05) ? random_.between(0.99, 1.01) : 1 + random_.between(-1e-7, 1e-7);
    return {q.x * length, q.y * length, q.z * length, q.w * length};
  }

  template <class T>
  void draw_pose(Columns& columns, size_t n, T& to) {
    if (random_.chance(0.3)) {
      to.positions_f64 = columns.doubles(draw_column<double>(n, [this] { return draw_position(); }));
    } else {
      to.positions = columns.floats(draw_column<float>(n, [this] { return draw_position(); }));
    }
    if (random_.chance(0.4)) to.rotations = columns.floats(draw_column<float>(n, [this] { return draw_rotation(); }));
  }

  template <class T>
  void draw_label_columns(Columns& columns, size_t n, T& to) {
    if (random_.chance(0.5)) to.layers = columns.words(draw_labels<uint32_t>(random_.chance(0.5) ? 1 : n));
    if (random_.chance(0.5)) to.groups = columns.ids(draw_labels<uint64_t>(random_.chance(0.5) ? 1 : n));
    if (random_.chance(0.5)) to.tags = columns.ids(draw_labels<uint64_t>(random_.chance(0.5) ? 1 : n));
  }

  InsertColumns draw_insert(Columns& columns, size_t items) {
    const size_t n = 1 + random_.below(items);
    InsertColumns insert;
    insert.ids = columns.ids(draw_ids(n));
    insert.kind = static_cast<ShapeKind>(random_.below(5));
    if (insert.kind == ShapeKind::kCompound) draw_parts(columns, insert);
    draw_pose(columns, n, insert);
    insert.extents = columns.floats(draw_column<float>(n, [this] { return draw_size(); }));
    insert.radii = columns.floats(draw_column<float>(n, [this] { return std::vector<double>{draw_size()[0]}; }));
    draw_label_columns(columns, n, insert);
    if (random_.chance(0.4)) insert.expire_ticks = columns.ids(draw_expire_ticks(random_.chance(0.3) ? 1 : n));
    return insert;
  }

  std::vector<uint64_t> draw_expire_ticks(size_t count) {
    std::vector<uint64_t> ticks(count);
    for (uint64_t& entry : ticks)
      entry = random_.chance(0.02) ? limits::kMaxExpireTicks + random_.below(2) : random_.below(25);
    return ticks;
  }

  MoveColumns draw_move(Columns& columns, size_t items) {
    const size_t n = 1 + random_.below(items);
    MoveColumns move;
    move.ids = columns.ids(draw_ids(n));
    draw_pose(columns, n, move);
    move.teleport = random_.chance(0.2);
    if (random_.chance(0.2)) draw_part_poses(columns, n, move);
    return move;
  }

  // Generates the parts of compounds: usually kParts parts, so that moves with new poses of parts often fit.
  void draw_parts(Columns& columns, InsertColumns& insert) {
    for (size_t left = random_.chance(0.8) ? kParts : 1 + random_.below(limits::kMaxParts); left > 0;) {
      const size_t n = 1 + random_.below(left);
      PartColumns parts;
      parts.kind = static_cast<ShapeKind>(1 + random_.below(3));
      std::vector<float> positions;
      for (size_t i = 0; i < n; ++i)
        for (const double value : draw_position())
          positions.push_back(static_cast<float>(random_.chance(0.003) ? bad_number() : value));
      parts.positions = columns.floats(std::move(positions));
      if (random_.chance(0.5))
        parts.rotations = columns.floats(draw_column<float>(n, [this] { return draw_rotation(); }));
      parts.extents = columns.floats(draw_column<float>(n, [this] { return draw_size(); }));
      parts.radii = columns.floats(draw_column<float>(n, [this] { return std::vector<double>{draw_size()[0]}; }));
      if (random_.chance(0.3)) parts.layers = columns.words(draw_labels<uint32_t>(random_.chance(0.5) ? 1 : n));
      insert.parts.push_back(parts);
      left -= n;
    }
  }
  void draw_part_poses(Columns& columns, size_t n, MoveColumns& move) {
    move.parts_each = static_cast<uint32_t>(random_.chance(0.9) ? kParts : 1 + random_.below(limits::kMaxParts));
    const size_t entries = move.parts_each * (random_.chance(0.5) ? n : 1);
    std::vector<float> positions, rotations;
    for (size_t i = 0; i < entries; ++i) {
      for (const double value : draw_position())
        positions.push_back(static_cast<float>(random_.chance(0.002) ? bad_number() : value));
      for (const double value : draw_rotation()) rotations.push_back(static_cast<float>(value));
    }
    const bool both = random_.chance(0.3), first = random_.chance(0.5);
    if (both || first) move.part_positions = columns.floats(std::move(positions));
    if (both || !first) move.part_rotations = columns.floats(std::move(rotations));
  }

  InstanceMoveColumns draw_instance_move(Columns& columns, size_t items) {
    const size_t n = 1 + random_.below(items);
    InstanceMoveColumns move;
    move.ids = columns.ids(draw_ids(n));
    draw_pose(columns, n, move);
    if (random_.chance(0.4)) move.scales = columns.floats(draw_scales(random_.chance(0.3) ? 1 : n));
    if (random_.chance(0.2)) {  // to the origin, where an instance may be already
      move = {move.ids, {}, columns.doubles({0, 0, 0}), {}, {}, false};
    }
    move.teleport = random_.chance(0.2);
    return move;
  }

  std::vector<float> draw_scales(size_t count) {
    constexpr float kBad[] = {std::numeric_limits<float>::quiet_NaN(), 0, -1, 2e12f};
    std::vector<float> scales;
    for (size_t i = 0; i < count; ++i)
      scales.push_back(random_.chance(0.02) ? random_.pick(kBad) : random_.float_between(0.1, 4));
    return scales;
  }

  RelabelColumns draw_relabel(Columns& columns, size_t items) {
    const size_t n = 1 + random_.below(items);
    RelabelColumns relabel;
    relabel.ids = columns.ids(draw_ids(n));
    draw_label_columns(columns, n, relabel);
    return relabel;
  }

  // Sets the writer id and the batch number: usually the writer's next number, sometimes a lower or a higher one. A
  // refused batch can leave a permanent gap in a writer's numbers, so the writers are replaced from time to time.
  void number(UpdateBatch& batch) {
    batch.writer = 1 + random_.below(3) + 3 * (drawn_++ / 100);
    uint64_t& next = next_numbers_[batch.writer];
    if (random_.chance(0.8)) {
      batch.batch = ++next;
    } else {
      batch.batch = 1 + random_.below(next + 2);
    }
  }

  Random& random_;
  uint64_t ids_;
  uint64_t drawn_ = 0;
  std::map<uint64_t, uint64_t> next_numbers_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_RANDOM_UPDATES_H_
