#include "core/scene/log/batch_codec.h"

#include "absl/strings/str_cat.h"

namespace locus {
namespace {

enum Flag : uint32_t {
  kHasTick = 1,
  kClear = 2,
  kUpsert = 4,
  kAllOrNothing = 8,
  kRestartTicks = 16,
  kAllFlags = 31,
};

// Minimum encoded size in bytes of an insert, move or relabel list: the lengths of its at least four columns.
constexpr size_t kMinListBytes = 32;

uint32_t flag(bool set, Flag flag) { return set ? flag : 0u; }

uint32_t flags_of(const UpdateBatch& batch) {
  return flag(batch.tick.has_value(), kHasTick) | flag(batch.clear, kClear) | flag(batch.upsert, kUpsert) |
         flag(batch.all_or_nothing, kAllOrNothing) | flag(batch.restart_ticks, kRestartTicks);
}

template <class Columns>
void write_pose(const Columns& columns, ByteWriter& writer) {
  writer.column(columns.ids);
  writer.column(columns.positions);
  writer.column(columns.positions_f64);
  writer.column(columns.rotations);
}

template <class Columns>
void read_pose(ByteReader& reader, Columns& columns) {
  columns.ids = reader.column<uint64_t>("ids");
  columns.positions = reader.column<float>("positions");
  columns.positions_f64 = reader.column<double>("positions_f64");
  columns.rotations = reader.column<float>("rotations");
}

template <class Columns>
void write_labels(const Columns& columns, ByteWriter& writer) {
  writer.column(columns.layers);
  writer.column(columns.groups);
  writer.column(columns.tags);
}

template <class Columns>
void read_labels(ByteReader& reader, Columns& columns) {
  columns.layers = reader.column<uint32_t>("layers");
  columns.groups = reader.column<uint64_t>("groups");
  columns.tags = reader.column<uint64_t>("tags");
}

void write_insert(const InsertColumns& insert, ByteWriter& writer) {
  const bool capsule = insert.kind == ShapeKind::kCapsule;
  writer.number(static_cast<uint64_t>(insert.kind));
  write_pose(insert, writer);
  if (insert.kind == ShapeKind::kBall || capsule) writer.column(insert.radii);
  if (insert.kind == ShapeKind::kBox || capsule) writer.column(insert.extents);
  write_labels(insert, writer);
}

InsertColumns read_insert(ByteReader& reader) {
  InsertColumns insert;
  insert.kind =
      static_cast<ShapeKind>(reader.number_upto(static_cast<uint64_t>(ShapeKind::kCapsule), "the kind of a shape"));
  const bool capsule = insert.kind == ShapeKind::kCapsule;
  read_pose(reader, insert);
  if (insert.kind == ShapeKind::kBall || capsule) insert.radii = reader.column<float>("radii");
  if (insert.kind == ShapeKind::kBox || capsule) insert.extents = reader.column<float>("extents");
  read_labels(reader, insert);
  return insert;
}

MoveColumns read_move(ByteReader& reader) {
  MoveColumns move;
  move.teleport = reader.number_upto(1, "whether moves teleport") != 0;
  read_pose(reader, move);
  return move;
}

RelabelColumns read_relabel(ByteReader& reader) {
  RelabelColumns relabel;
  relabel.ids = reader.column<uint64_t>("ids");
  read_labels(reader, relabel);
  return relabel;
}

template <class Columns, class Read>
void read_lists(ByteReader& reader, const char* what, std::vector<Columns>& lists, const Read& read) {
  const uint64_t count = reader.count(kMinListBytes, what);
  lists.reserve(count);
  for (uint64_t i = 0; i < count && reader.good(); ++i) lists.push_back(read(reader));
}

}  // namespace

void write_batch(const UpdateBatch& batch, ByteWriter& writer) {
  writer.number(uint64_t{flags_of(batch)});
  for (int axis = 0; axis < 3; ++axis) writer.number(batch.frame[axis]);
  writer.number(batch.tick.value_or(0));
  writer.number(batch.writer);
  writer.number(batch.batch);
  writer.column(batch.remove_ids);
  writer.column(batch.remove_groups);
  writer.number(uint64_t{batch.inserts.size()});
  for (const InsertColumns& insert : batch.inserts) write_insert(insert, writer);
  writer.number(uint64_t{batch.moves.size()});
  for (const MoveColumns& move : batch.moves) {
    writer.number(uint64_t{move.teleport});
    write_pose(move, writer);
  }
  writer.number(uint64_t{batch.relabels.size()});
  for (const RelabelColumns& relabel : batch.relabels) {
    writer.column(relabel.ids);
    write_labels(relabel, writer);
  }
}

UpdateBatch read_batch(ByteReader& reader) {
  UpdateBatch batch;
  const auto flags = static_cast<uint32_t>(reader.number_upto(kAllFlags, "the flags of a batch"));
  batch.clear = (flags & kClear) != 0;
  batch.upsert = (flags & kUpsert) != 0;
  batch.all_or_nothing = (flags & kAllOrNothing) != 0;
  batch.restart_ticks = (flags & kRestartTicks) != 0;
  for (int axis = 0; axis < 3; ++axis) batch.frame[axis] = reader.real("the frame");
  const uint64_t tick = reader.number("the tick");
  if ((flags & kHasTick) != 0) batch.tick = tick;
  batch.writer = reader.number("the writer");
  batch.batch = reader.number("the number of a batch");
  batch.remove_ids = reader.column<uint64_t>("remove_ids");
  batch.remove_groups = reader.column<uint64_t>("remove_groups");
  read_lists(reader, "the number of inserts", batch.inserts, read_insert);
  read_lists(reader, "the number of moves", batch.moves, read_move);
  read_lists(reader, "the number of relabels", batch.relabels, read_relabel);
  if (!reader.good()) return {};
  if (const absl::Status form = check_form(batch); !form.ok())
    reader.fail("a batch", absl::StrCat("is of wrong form: ", form.message()));
  return batch;
}

}  // namespace locus
