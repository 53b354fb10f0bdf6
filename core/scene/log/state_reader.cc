#include "core/scene/log/state_reader.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/column.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "core/scene/log/mesh_codec.h"

namespace locus {
namespace {

constexpr size_t kMinWriterBytes = size_t{8} * 8;
constexpr size_t kMinErrorBytes = size_t{3} * 8;

UpdateAck read_ack(ByteReader& reader, BytesKind kind) {
  UpdateAck ack;
  ack.epoch = reader.number("the epoch of an ack");
  ack.revision = reader.number("the revision of an ack");
  ack.tick = reader.number("the tick of an ack");
  const ByteReader::Pair counts = reader.pair("the counts of an ack");
  ack.applied = counts.first;
  ack.refused = counts.second;
  const uint64_t errors = reader.count(kMinErrorBytes, "the number of errors of an ack");
  if (errors > limits::kMaxListedItemErrors) reader.fail("the number of errors of an ack", "is out of range");
  for (uint64_t i = 0; i < errors && reader.good(); ++i) {
    ItemError& error = ack.errors.emplace_back();
    const ByteReader::Pair pair = reader.pair("an error of an ack");
    error.index = pair.first;
    if (pair.second > static_cast<uint32_t>(kLastReason)) reader.fail("the reason of an error", "is unknown");
    error.reason = static_cast<Reason>(pair.second);
    error.id = reader.number("the id of an error");
    if (kind == BytesKind::kMessageWriters)
      error.message =
          static_cast<uint32_t>(reader.number_upto(limits::kMaxUpdateMessages - 1, "the message of an error"));
    error.field = std::string(reader.text(kMaxErrorField, "the field of an error"));
  }
  return ack;
}

// Returns true if all values are within [min, max], and none is NaN.
template <class T>
bool all_within(absl::Span<const T> values, double min, double max) {
  bool valid = true;
  for (const T value : values) valid &= value >= min && value <= max;
  return valid;
}

bool all_unit(absl::Span<const float> quaternions) {
  bool valid = true;
  for (size_t i = 0; i < quaternions.size(); i += 4) {
    const float* q = &quaternions[i];
    valid &= unit_deviation({q[0], q[1], q[2], q[3]}) <= limits::kMaxQuaternionDeviation;
  }
  return valid;
}

struct LabelColumns {
  absl::Span<const uint64_t> ids, groups, tags;
  absl::Span<const uint32_t> layers;

  LabelColumns(ByteReader& reader, size_t max) {
    ids = reader.column<uint64_t>("ids");
    if (ids.empty() || ids.size() > max) reader.fail("ids", "are missing or too many");
    if (std::find(ids.begin(), ids.end(), kNoId) != ids.end()) reader.fail("an id", "is 0");
    groups = reader.shared_column<uint64_t>(ids.size(), 1, "groups");
    tags = reader.shared_column<uint64_t>(ids.size(), 1, "tags");
    layers = reader.shared_column<uint32_t>(ids.size(), 1, "layers");
  }
};

struct ShapeColumns {
  absl::Span<const uint8_t> kinds;
  absl::Span<const double> positions;
  absl::Span<const float> rotations, sizes, radii;

  ShapeColumns(ByteReader& reader, size_t n, ShapeKind max_kind) {
    kinds = reader.shared_column<uint8_t>(n, 1, "kinds");
    positions = reader.shared_column<double>(n, 3, "positions");
    rotations = reader.shared_column<float>(n, 4, "rotations");
    sizes = reader.shared_column<float>(n, 3, "sizes");
    radii = reader.shared_column<float>(n, 1, "radii");
    constexpr double kMax = limits::kMaxCoordinate;
    if (!all_within(kinds, 0, static_cast<double>(max_kind))) reader.fail("the kind of a shape", "is unknown");
    if (!all_within(positions, -kMax, kMax)) reader.fail("a position", "is out of range");
    if (!all_unit(rotations)) reader.fail("a rotation", "is not of unit length");
    if (!all_within(sizes, -kMax, kMax)) reader.fail("a size", "is out of range");
    if (!all_within(radii, 0, kMax)) reader.fail("a radius", "is out of range");
  }
};

template <class T>
void append(std::vector<T>& to, const ColumnReader<T>& column, size_t i, size_t width) {
  to.insert(to.end(), column.entry(i), column.entry(i) + width);
}

}  // namespace

absl::Status StateReader::add(absl::string_view chunk) {
  const AlignedBytes aligned(chunk);
  ByteReader reader(aligned.bytes());
  const BytesKind kind = read_kind(reader);
  const bool is_header = kind == BytesKind::kStateHeader || kind == BytesKind::kExtendedHeader;
  if (reader.good() && is_header == begun_) reader.fail("the header", "is not first");
  if (is_header) {
    read_header(reader, kind);
  } else if (kind == BytesKind::kStateWriters || kind == BytesKind::kMessageWriters) {
    read_writers(reader, kind);
  } else if (kind == BytesKind::kStateInstances || kind == BytesKind::kNamedInstances ||
             kind == BytesKind::kBoundedInstances) {
    read_instances(reader, kind);
  } else if (kind == BytesKind::kStateCompounds) {
    read_compounds(reader);
  } else if (kind == BytesKind::kStateObjects || kind == BytesKind::kCompoundObjects) {
    read_objects(reader, kind);
  } else if (kind == BytesKind::kStateExpiries) {
    read_expiries(reader);
  } else if (kind == BytesKind::kStateLeases) {
    read_leases(reader);
  } else {
    reader.fail("the kind of a chunk", "is not known");
  }
  reader.end("a chunk");
  return reader.status();
}

void StateReader::read_header(ByteReader& reader, BytesKind kind) {
  begun_ = true;
  state_.epoch = reader.number("the epoch");
  if (reader.good() && state_.epoch == 0) reader.fail("the epoch", "is 0");
  state_.revision = reader.number("the revision");
  state_.tick = reader.number("the tick");
  state_.has_past = reader.number_upto(1, "the flag has_past") != 0;
  writers_ = reader.number_upto(limits::kMaxWriters, "the number of writers");
  instances_ = reader.number_upto(limits::kMaxInstances, "the number of instances");
  objects_ = reader.number_upto(limits::kMaxObjects, "the number of objects");
  state_.cell_size = reader.real("the size of cells");
  if (!(state_.cell_size >= 0x1p-40 && state_.cell_size <= 0x1p40)) reader.fail("the size of cells", "is out of range");
  if (kind != BytesKind::kExtendedHeader) return;
  expiries_ = reader.number_upto(objects_, "the number of expiries");
  leases_ = reader.number_upto(limits::kMaxLeases, "the number of leases");
}

void StateReader::read_writers(ByteReader& reader, BytesKind kind) {
  while (reader.good() && reader.left() >= kMinWriterBytes) {
    WriterTable::Writer writer;
    writer.number = reader.number("a writer");
    writer.batch = reader.number("the last batch of a writer");
    writer.heard = reader.number("the activity count of a writer");
    writer.ack = read_ack(reader, kind);
    if (reader.good() && !state_.writers.restore(std::move(writer))) reader.fail("a writer", "occurs twice, or is 0");
  }
}

void StateReader::read_instances(ByteReader& reader, BytesKind kind) {
  std::vector<MeshKey> meshes;
  for (const Sha256& sha256 : reader.column<Sha256>("the contents of meshes")) meshes.push_back({sha256, ""});
  if (kind != BytesKind::kStateInstances)
    for (MeshKey& mesh : meshes) mesh.name = std::string(reader.text(limits::kMaxNameLength, "the name of a mesh"));
  if (kind == BytesKind::kBoundedInstances) read_bounds(reader, meshes);
  const LabelColumns labels(reader, kInstancesPerChunk);
  const size_t n = labels.ids.size();
  const auto mesh_indices = reader.shared_column<uint32_t>(n, 1, "the meshes of instances");
  const auto translations = reader.shared_column<double>(n, 3, "translations");
  const auto rotations = reader.shared_column<float>(n, 4, "rotations");
  const auto scales = reader.shared_column<float>(n, 1, "scales");
  if (reader.good() && !all_within(mesh_indices, 0, static_cast<double>(meshes.size()) - 1))
    reader.fail("the mesh of an instance", "is unknown");
  if (!reader.good()) return;
  for (size_t i = 0; i < n; ++i) {
    Placed& placed = placed_[meshes[*ColumnReader<uint32_t>(mesh_indices, 1).entry(i)]];
    placed.ids.push_back(labels.ids[i]);
    append(placed.groups, ColumnReader<uint64_t>(labels.groups, 1), i, 1);
    append(placed.tags, ColumnReader<uint64_t>(labels.tags, 1), i, 1);
    append(placed.layers, ColumnReader<uint32_t>(labels.layers, 1), i, 1);
    append(placed.translations, ColumnReader<double>(translations, 3), i, 3);
    append(placed.rotations, ColumnReader<float>(rotations, 4), i, 4);
    append(placed.scales, ColumnReader<float>(scales, 1), i, 1);
  }
  instances_read_ += n;
}

void StateReader::read_bounds(ByteReader& reader, absl::Span<const MeshKey> meshes) {
  const auto bounds = reader.column<std::array<float, 6>>("the bounds of meshes");
  if (bounds.size() != meshes.size()) reader.fail("the bounds of meshes", "have a wrong length");
  for (size_t i = 0; i < meshes.size() && reader.good(); ++i)
    mesh_bounds_[meshes[i]] = decode_bounds(bounds[i].data(), reader);
}

void StateReader::read_compounds(ByteReader& reader) {
  const uint64_t all = reader.number_upto(limits::kMaxObjects, "the number of compounds");
  if (compounds_ != 0 && all != compounds_) reader.fail("the number of compounds", "differs from an earlier chunk");
  compounds_ = all;
  const auto counts = reader.column<uint8_t>("the numbers of parts");
  const size_t n = std::accumulate(counts.begin(), counts.end(), size_t{0});
  if (n > kPartsPerChunk || !all_within(counts, 1, limits::kMaxParts))
    reader.fail("the number of parts of a compound", "is out of range");
  const auto kinds = reader.shared_column<uint8_t>(n, 1, "the kinds of parts");
  const auto positions = reader.shared_column<float>(n, 3, "the positions of parts");
  const auto rotations = reader.shared_column<float>(n, 4, "the rotations of parts");
  const auto sizes = reader.shared_column<float>(n, 3, "the sizes of parts");
  const auto radii = reader.shared_column<float>(n, 1, "the radii of parts");
  const auto layers = reader.shared_column<uint32_t>(n, 1, "the layers of parts");
  constexpr double kMax = limits::kMaxCoordinate;
  if (!all_within(kinds, static_cast<double>(ShapeKind::kBall), static_cast<double>(ShapeKind::kCapsule)))
    reader.fail("the kind of a part", "is unknown");
  if (!all_within(positions, -kMax, kMax)) reader.fail("the position of a part", "is out of range");
  if (!all_unit(rotations)) reader.fail("the rotation of a part", "is not of unit length");
  if (!all_within(sizes, -kMax, kMax)) reader.fail("the size of a part", "is out of range");
  if (!all_within(radii, 0, kMax)) reader.fail("the radius of a part", "is out of range");
  if (!reader.good()) return;
  size_t i = 0;
  for (const uint8_t count : counts) {
    std::vector<Part> parts(count);
    for (Part& part : parts) {
      const float* const p = ColumnReader<float>(positions, 3).entry(i);
      const float* const q = ColumnReader<float>(rotations, 4).entry(i);
      const float* const s = ColumnReader<float>(sizes, 3).entry(i);
      part = {static_cast<ShapeKind>(*ColumnReader<uint8_t>(kinds, 1).entry(i)),
              {p[0], p[1], p[2]},
              {q[0], q[1], q[2], q[3]},
              {s[0], s[1], s[2]},
              *ColumnReader<float>(radii, 1).entry(i),
              *ColumnReader<uint32_t>(layers, 1).entry(i)};
      if (part.kind == ShapeKind::kBox && !(s[0] >= 0 && s[1] >= 0 && s[2] >= 0))
        return reader.fail("the extent of a box", "is negative");
      ++i;
    }
    state_.compounds.push_back(Compound::make(std::move(parts)));
  }
}

void StateReader::read_objects(ByteReader& reader, BytesKind kind) {
  const bool has_compounds = kind == BytesKind::kCompoundObjects;
  const LabelColumns labels(reader, kObjectsPerChunk);
  const size_t n = labels.ids.size();
  const ShapeColumns shapes(reader, n, has_compounds ? ShapeKind::kCompound : ShapeKind::kCapsule);
  absl::Span<const uint32_t> compounds;
  if (has_compounds) compounds = reader.shared_column<uint32_t>(n, 1, "the compounds of objects");
  if (!reader.good()) return;
  const ColumnReader<uint64_t> groups(labels.groups, 1), tags(labels.tags, 1);
  const ColumnReader<uint32_t> layers(labels.layers, 1);
  const ColumnReader<uint8_t> kinds(shapes.kinds, 1);
  const ColumnReader<double> positions(shapes.positions, 3);
  const ColumnReader<float> rotations(shapes.rotations, 4), sizes(shapes.sizes, 3), radii(shapes.radii, 1);
  std::vector<Object>& objects = state_.objects.emplace_back(n);
  for (size_t i = 0; i < n; ++i) {
    Object& object = objects[i];
    object.id = labels.ids[i];
    object.group = *groups.entry(i);
    object.tag = *tags.entry(i);
    object.layers = *layers.entry(i);
    const double* p = positions.entry(i);
    const float* q = rotations.entry(i);
    const float* s = sizes.entry(i);
    object.shape = {static_cast<ShapeKind>(*kinds.entry(i)),
                    {p[0], p[1], p[2]},
                    {q[0], q[1], q[2], q[3]},
                    {s[0], s[1], s[2]},
                    *radii.entry(i)};
    if (object.shape.kind == ShapeKind::kCompound) {
      const uint32_t number = *ColumnReader<uint32_t>(compounds, 1).entry(i);
      if (number >= state_.compounds.size()) return reader.fail("the compound of an object", "is unknown");
      object.compound = state_.compounds[number].get();
    }
    const bool box = object.shape.kind == ShapeKind::kBox;
    if (box && !(s[0] >= 0 && s[1] >= 0 && s[2] >= 0)) reader.fail("the extent of a box", "is negative");
  }
  objects_read_ += n;
}

// Builds the set of instances by placing all decoded instances in an empty set. The transforms of instances are stored
// exactly, so the result equals the encoded set.
absl::Status StateReader::place(const FindMesh& find_mesh) {
  StaticChange change;
  for (const auto& [mesh, placed] : placed_) {
    PlacementColumns place{find_mesh(mesh), placed.ids,    placed.translations, placed.rotations,
                           placed.scales,   placed.layers, placed.groups,       placed.tags};
    if (place.mesh == nullptr) return data_loss("a mesh that instances use is missing");
    change.place.push_back(std::move(place));
  }
  const auto no_object = [](Id) { return false; };
  absl::StatusOr<StaticSet::Changed> changed = StaticSet::empty()->apply(change, no_object, ids_from(kFirstChosenId));
  if (!changed.ok()) return data_loss(absl::StrCat("an instance is wrong: ", changed.status().message()));
  state_.statics = std::move(changed->set);
  return absl::OkStatus();
}

void StateReader::read_expiries(ByteReader& reader) {
  const auto ids = reader.column<uint64_t>("ids");
  const auto remaining = reader.shared_column<uint64_t>(ids.size(), 1, "the ticks until objects expire");
  if (ids.empty() || ids.size() > kLifetimesPerChunk) reader.fail("ids", "are missing or too many");
  if (std::any_of(remaining.begin(), remaining.end(),
                  [](uint64_t ticks) { return ticks == 0 || ticks > limits::kMaxExpireTicks; }))
    reader.fail("the ticks until an object expires", "are out of range");
  if (!reader.good()) return;
  const ColumnReader<uint64_t> ticks(remaining, 1);
  for (size_t i = 0; i < ids.size(); ++i) state_.expiries.emplace_back(ids[i], *ticks.entry(i));
}

void StateReader::read_leases(ByteReader& reader) {
  constexpr size_t kMinLeaseBytes = size_t{4} * 8;
  while (reader.good() && reader.left() >= kMinLeaseBytes) {
    const uint64_t writer = reader.number("the writer of a lease");
    const uint64_t lease_ms = reader.number_upto(limits::kMaxLeaseMs, "a lease");
    const uint64_t later = reader.number_upto(objects_, "the number of objects of a lease");
    const auto ids = reader.column<uint64_t>("ids");
    if (writer == 0 || lease_ms == 0) reader.fail("a lease or its writer", "is 0");
    const bool continued = leased_objects_ != 0;
    const bool follows = continued ? state_.leases.back().writer == writer && leased_objects_ == later + ids.size()
                                   : state_.leases.empty() || state_.leases.back().writer < writer;
    if (!follows) reader.fail("a lease", "is not in order");
    if (!reader.good()) return;
    if (!continued) state_.leases.emplace_back();
    SceneState::StoredLease& lease = state_.leases.back();
    lease.writer = writer;
    lease.lease_ms = static_cast<uint32_t>(lease_ms);
    lease.ids.insert(lease.ids.end(), ids.begin(), ids.end());
    leased_objects_ = later;
  }
}

absl::Status StateReader::check_counts() const {
  if (state_.writers.size() != writers_ || instances_read_ != instances_ || objects_read_ != objects_)
    return data_loss(absl::StrCat("the header counts ", writers_, " writers, ", instances_, " instances and ", objects_,
                                  " objects, the chunks contain ", state_.writers.size(), ", ", instances_read_,
                                  " and ", objects_read_));
  if (state_.compounds.size() != compounds_)
    return data_loss(
        absl::StrCat("the chunks count ", compounds_, " compounds, and contain ", state_.compounds.size()));
  if (state_.expiries.size() != expiries_ || state_.leases.size() != leases_ || leased_objects_ != 0)
    return data_loss(absl::StrCat("the header counts ", expiries_, " expiries and ", leases_,
                                  " leases, the chunks contain ", state_.expiries.size(), " and ", state_.leases.size(),
                                  "; ", leased_objects_, " objects of the last lease are missing"));
  return absl::OkStatus();
}

absl::StatusOr<SceneState> StateReader::finish(const FindMesh& find_mesh) && {
  if (!begun_) return data_loss("the header is missing");
  RETURN_IF_ERROR(check_counts());
  RETURN_IF_ERROR(place(find_mesh));
  return std::move(state_);
}

}  // namespace locus
