#include "core/scene/log/record_codec.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/scene/log/mesh_codec.h"

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

// Lower bounds of encoded sizes in bytes. The decoder refuses a count if the counted items cannot fit into the
// remaining bytes of the record. Otherwise a damaged count could make the decoder reserve too much memory.
constexpr size_t kMinListBytes = 32;  // an insert, move or relabel has at least four columns with 8-byte lengths
constexpr size_t kMinBatchBytes = 96;
constexpr size_t kMinPlacementBytes = 32 + 7 * 8;

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

// Parts of a batch that a kind of record stores after the parts that every kind stores.
enum class BatchParts {
  kBase,
  kInstances,  // also the changes of instances
  kExtended,   // also the changes of instances, compounds, new poses of parts, expiry ticks and leases
};

bool is_extended(const UpdateBatch& batch) {
  return batch.lease_ms != 0 || batch.end_lease != 0 ||
         std::any_of(batch.inserts.begin(), batch.inserts.end(),
                     [](const InsertColumns& insert) {
                       return !insert.expire_ticks.empty() || insert.kind == ShapeKind::kCompound;
                     }) ||
         std::any_of(batch.moves.begin(), batch.moves.end(),
                     [](const MoveColumns& move) { return move.parts_each != 0; });
}

// Write and read the columns of radii and extents that the kind of the shapes has.
template <class Columns>
void write_size(const Columns& columns, ByteWriter& writer) {
  const bool capsule = columns.kind == ShapeKind::kCapsule;
  if (columns.kind == ShapeKind::kBall || capsule) writer.column(columns.radii);
  if (columns.kind == ShapeKind::kBox || capsule) writer.column(columns.extents);
}

template <class Columns>
void read_size(ByteReader& reader, Columns& columns) {
  const bool capsule = columns.kind == ShapeKind::kCapsule;
  if (columns.kind == ShapeKind::kBall || capsule) columns.radii = reader.column<float>("radii");
  if (columns.kind == ShapeKind::kBox || capsule) columns.extents = reader.column<float>("extents");
}

ShapeKind read_shape_kind(ByteReader& reader, ShapeKind max) {
  return static_cast<ShapeKind>(reader.number_upto(static_cast<uint64_t>(max), "the kind of a shape"));
}

void write_compound(const std::vector<PartColumns>& parts, ByteWriter& writer) {
  writer.number(uint64_t{parts.size()});
  for (const PartColumns& columns : parts) {
    writer.number(static_cast<uint64_t>(columns.kind));
    writer.column(columns.positions);
    writer.column(columns.rotations);
    write_size(columns, writer);
    writer.column(columns.layers);
  }
}

std::vector<PartColumns> read_compound(ByteReader& reader) {
  std::vector<PartColumns> parts(reader.count(kMinListBytes, "the number of lists of parts"));
  for (PartColumns& columns : parts) {
    columns.kind = read_shape_kind(reader, ShapeKind::kCapsule);
    if (columns.kind == ShapeKind::kPoint) reader.fail("the kind of a part", "is out of range");
    columns.positions = reader.column<float>("the positions of parts");
    columns.rotations = reader.column<float>("the rotations of parts");
    read_size(reader, columns);
    columns.layers = reader.column<uint32_t>("the layers of parts");
    if (!reader.good()) return {};
  }
  return parts;
}

void write_insert(const InsertColumns& insert, BatchParts parts, ByteWriter& writer) {
  LOCUS_DCHECK(insert.kind != ShapeKind::kCompound || parts == BatchParts::kExtended);
  writer.number(static_cast<uint64_t>(insert.kind));
  write_pose(insert, writer);
  write_size(insert, writer);
  if (insert.kind == ShapeKind::kCompound) write_compound(insert.parts, writer);
  write_labels(insert, writer);
  if (parts == BatchParts::kExtended) writer.column(insert.expire_ticks);
}

InsertColumns read_insert(ByteReader& reader, BatchParts parts) {
  InsertColumns insert;
  insert.kind = read_shape_kind(reader, parts == BatchParts::kExtended ? ShapeKind::kCompound : ShapeKind::kCapsule);
  read_pose(reader, insert);
  read_size(reader, insert);
  if (insert.kind == ShapeKind::kCompound) insert.parts = read_compound(reader);
  read_labels(reader, insert);
  if (parts == BatchParts::kExtended) insert.expire_ticks = reader.column<uint64_t>("expire_ticks");
  return insert;
}

void write_move(const MoveColumns& move, BatchParts parts, ByteWriter& writer) {
  LOCUS_DCHECK(move.parts_each == 0 || parts == BatchParts::kExtended);
  writer.number(uint64_t{move.teleport});
  write_pose(move, writer);
  if (parts != BatchParts::kExtended) return;
  writer.number(uint64_t{move.parts_each});
  writer.column(move.part_positions);
  writer.column(move.part_rotations);
}

MoveColumns read_move(ByteReader& reader, BatchParts parts) {
  MoveColumns move;
  move.teleport = reader.number_upto(1, "whether moves teleport") != 0;
  read_pose(reader, move);
  if (parts != BatchParts::kExtended) return move;
  move.parts_each = static_cast<uint32_t>(reader.number_upto(limits::kMaxParts, "the number of parts"));
  move.part_positions = reader.column<float>("part_positions");
  move.part_rotations = reader.column<float>("part_rotations");
  return move;
}

InstanceMoveColumns read_instance_move(ByteReader& reader) {
  InstanceMoveColumns move;
  move.teleport = reader.number_upto(1, "whether moves of instances teleport") != 0;
  read_pose(reader, move);
  move.scales = reader.column<float>("scales");
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

void write_relabels(const std::vector<RelabelColumns>& relabels, ByteWriter& writer) {
  writer.number(uint64_t{relabels.size()});
  for (const RelabelColumns& relabel : relabels) {
    writer.column(relabel.ids);
    write_labels(relabel, writer);
  }
}

// Appends the changes of instances of `batch`, which follow the other changes.
void write_instance_changes(const UpdateBatch& batch, ByteWriter& writer) {
  writer.number(uint64_t{batch.instance_moves.size()});
  for (const InstanceMoveColumns& move : batch.instance_moves) {
    writer.number(uint64_t{move.teleport});
    write_pose(move, writer);
    writer.column(move.scales);
  }
  write_relabels(batch.instance_relabels, writer);
}

// Appends `parts` of `batch` to `writer`, without earlier messages. Precondition: `batch` has passed check_form().
// O(bytes): copies each column.
void write_batch(const UpdateBatch& batch, BatchParts parts, ByteWriter& writer) {
  writer.number(uint64_t{flags_of(batch)});
  for (int axis = 0; axis < 3; ++axis) writer.number(batch.frame[axis]);
  writer.number(batch.tick.value_or(0));
  writer.number(batch.writer);
  writer.number(batch.batch);
  writer.column(batch.remove_ids);
  writer.column(batch.remove_groups);
  writer.number(uint64_t{batch.inserts.size()});
  for (const InsertColumns& insert : batch.inserts) write_insert(insert, parts, writer);
  writer.number(uint64_t{batch.moves.size()});
  for (const MoveColumns& move : batch.moves) write_move(move, parts, writer);
  write_relabels(batch.relabels, writer);
  if (parts != BatchParts::kBase) write_instance_changes(batch, writer);
  if (parts != BatchParts::kExtended) return;
  writer.number(uint64_t{batch.lease_ms});
  writer.number(batch.end_lease);
}

// Sets the error of `reader` if `batch` does not pass check_form().
UpdateBatch checked(UpdateBatch batch, ByteReader& reader) {
  if (!reader.good()) return {};
  if (const absl::Status form = check_form(batch); !form.ok())
    reader.fail("a batch", absl::StrCat("is of wrong form: ", form.message()));
  return batch;
}

// Reads a batch whose columns borrow from the bytes of `reader`.
UpdateBatch read_unchecked(ByteReader& reader, BatchParts parts) {
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
  read_lists(reader, "the number of inserts", batch.inserts,
             [parts](ByteReader& from) { return read_insert(from, parts); });
  read_lists(reader, "the number of moves", batch.moves, [parts](ByteReader& from) { return read_move(from, parts); });
  read_lists(reader, "the number of relabels", batch.relabels, read_relabel);
  if (parts != BatchParts::kBase) {
    read_lists(reader, "the number of moves of instances", batch.instance_moves, read_instance_move);
    read_lists(reader, "the number of relabels of instances", batch.instance_relabels, read_relabel);
  }
  if (parts == BatchParts::kExtended) {
    batch.lease_ms = static_cast<uint32_t>(reader.number_upto(limits::kMaxLeaseMs, "the lease"));
    batch.end_lease = reader.number("the writer whose lease ends");
  }
  return batch;
}

// Reads a batch that was not sent as several messages. If it does not pass check_form(), sets the error of `reader`.
UpdateBatch read_batch(ByteReader& reader, BatchParts parts) { return checked(read_unchecked(reader, parts), reader); }

// Reads a batch that was sent as several messages.
UpdateBatch read_grouped(ByteReader& reader) {
  const uint64_t count = reader.count(kMinBatchBytes, "the number of messages");
  if (reader.good() && count == 0) reader.fail("the number of messages", "is 0");
  std::vector<UpdateBatch> messages;
  messages.reserve(count);
  for (uint64_t i = 0; i < count && reader.good(); ++i)
    messages.push_back(read_unchecked(reader, BatchParts::kExtended));
  if (!reader.good()) return {};
  UpdateBatch batch = std::move(messages.back());
  messages.pop_back();
  batch.earlier = std::move(messages);
  return checked(std::move(batch), reader);
}

Record::Joined read_joined(ByteReader& reader) {
  Record::Joined joined;
  const uint64_t count = reader.count(kMinBatchBytes, "the number of batches");
  joined.batches.reserve(count);
  for (uint64_t i = 0; i < count && reader.good(); ++i) {
    joined.batches.push_back(read_batch(reader, BatchParts::kBase));
    if (reader.good() && !may_join(joined.batches.front(), joined.batches.back()))
      reader.fail(absl::StrCat("batch ", i), "cannot have been joined");
  }
  if (reader.good() && count == 0) reader.fail("the number of batches", "is 0");
  return joined;
}

void write_placement(const PlacementColumns& place, absl::Span<const Id> ids, ByteWriter& writer) {
  writer.column(absl::MakeConstSpan(place.mesh->sha256()));
  writer.text(place.mesh->name());
  writer.column(absl::MakeConstSpan(encode_bounds(place.mesh->bounds())));
  writer.column(ids);
  writer.column(place.translations);
  writer.column(place.rotations);
  writer.column(place.scales);
  writer.column(place.layers);
  writer.column(place.groups);
  writer.column(place.tags);
}

Aabbf read_bounds(ByteReader& reader) {
  const auto numbers = reader.column<float>("the bounds of a mesh");
  if (numbers.size() == 6) return decode_bounds(numbers.data(), reader);
  reader.fail("the bounds of a mesh", "have a wrong length");
  return {};
}

// Reads a placement, without its mesh, whose key and bounds are appended to those of `change`.
PlacementColumns read_placement(ByteReader& reader, BytesKind kind, Record::Change& change) {
  MeshKey& mesh = change.meshes.emplace_back();
  const auto sha256 = reader.column<uint8_t>("the hash of a mesh's content");
  if (sha256.size() == mesh.sha256.size())
    std::copy(sha256.begin(), sha256.end(), mesh.sha256.begin());
  else
    reader.fail("the hash of a mesh's content", "has a wrong length");
  if (kind != BytesKind::kStaticChange)
    mesh.name = std::string(reader.text(limits::kMaxNameLength, "the name of a mesh"));
  if (kind == BytesKind::kBoundedChange) change.bounds.push_back(read_bounds(reader));
  PlacementColumns place;
  place.ids = reader.column<uint64_t>("ids");
  place.translations = reader.column<double>("translations");
  place.rotations = reader.column<float>("rotations");
  place.scales = reader.column<float>("scales");
  place.layers = reader.column<uint32_t>("layers");
  place.groups = reader.column<uint64_t>("groups");
  place.tags = reader.column<uint64_t>("tags");
  if (place.ids.empty() && !place.translations.empty()) reader.fail("a placement", "has no ids");
  return place;
}

bool is_change(BytesKind kind) {
  return kind == BytesKind::kStaticChange || kind == BytesKind::kNamedChange || kind == BytesKind::kBoundedChange;
}

Record::Change read_change(ByteReader& reader, BytesKind kind) {
  Record::Change read;
  read.change.remove_ids = reader.column<uint64_t>("remove_ids");
  read.change.remove_groups = reader.column<uint64_t>("remove_groups");
  const uint64_t count = reader.count(kMinPlacementBytes, "the number of placements");
  read.change.place.reserve(count);
  for (uint64_t i = 0; i < count && reader.good(); ++i) read.change.place.push_back(read_placement(reader, kind, read));
  return read;
}

}  // namespace

void encode_batch(const UpdateBatch& batch, std::string& to) {
  ByteWriter writer(to);
  if (!batch.earlier.empty()) {
    write_kind(writer, BytesKind::kGroupedBatch);
    writer.number(uint64_t{batch.earlier.size() + 1});
    for (const UpdateBatch& message : batch.earlier) write_batch(message, BatchParts::kExtended, writer);
    write_batch(batch, BatchParts::kExtended, writer);
  } else if (is_extended(batch)) {
    write_kind(writer, BytesKind::kExtendedBatch);
    write_batch(batch, BatchParts::kExtended, writer);
  } else {
    const bool instances = has_instances(batch);
    write_kind(writer, instances ? BytesKind::kInstanceBatch : BytesKind::kBatch);
    write_batch(batch, instances ? BatchParts::kInstances : BatchParts::kBase, writer);
  }
}

void encode_joined(absl::Span<const UpdateBatch* const> batches, std::string& to) {
  ByteWriter writer(to);
  write_kind(writer, BytesKind::kJoinedBatches);
  writer.number(uint64_t{batches.size()});
  for (const UpdateBatch* batch : batches) write_batch(*batch, BatchParts::kBase, writer);
}

void encode_change(const StaticChange& change, absl::Span<const Id> placed, std::string& to) {
  ByteWriter writer(to);
  write_kind(writer, BytesKind::kBoundedChange);
  writer.column(change.remove_ids);
  writer.column(change.remove_groups);
  writer.number(uint64_t{change.place.size()});
  for (const PlacementColumns& place : change.place) {
    const size_t count = place.count();
    LOCUS_CHECK_LE(count, placed.size());
    write_placement(place, placed.subspan(0, count), writer);
    placed.remove_prefix(count);
  }
  LOCUS_CHECK(placed.empty());
}

absl::StatusOr<Record> Record::decode(absl::string_view bytes) {
  Record record(bytes);
  ByteReader reader(record.bytes_.bytes());
  const BytesKind kind = read_kind(reader);
  if (kind == BytesKind::kBatch) {
    record.content_ = read_batch(reader, BatchParts::kBase);
  } else if (kind == BytesKind::kInstanceBatch) {
    record.content_ = read_batch(reader, BatchParts::kInstances);
  } else if (kind == BytesKind::kExtendedBatch) {
    record.content_ = read_batch(reader, BatchParts::kExtended);
  } else if (kind == BytesKind::kGroupedBatch) {
    record.content_ = read_grouped(reader);
  } else if (kind == BytesKind::kJoinedBatches) {
    record.content_ = read_joined(reader);
  } else if (is_change(kind)) {
    record.content_ = read_change(reader, kind);
  } else {
    reader.fail("the kind of a record", "is not known");
  }
  reader.end("a record");
  if (!reader.good()) return reader.status();
  return record;
}

}  // namespace locus
