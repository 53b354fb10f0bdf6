#include "core/scene/spec_codec.h"

#include <algorithm>
#include <utility>

#include "core/base/limits.h"
#include "core/scene/log/byte_codec.h"

namespace locus {
namespace {

template <class Enum>
Enum read_enum(ByteReader& reader, Enum max, const char* what) {
  return static_cast<Enum>(reader.number_upto(static_cast<uint64_t>(max), what));
}

void read_labels(ByteReader& reader, SceneSpec& spec) {
  const uint64_t labels = reader.number_upto(limits::kMaxLabels, "the number of labels");
  for (uint64_t i = 0; i < labels; ++i) {
    std::string key(reader.text(limits::kMaxLabelLength, "a label"));
    const bool added = spec.labels.emplace(std::move(key), reader.text(limits::kMaxLabelLength, "a label")).second;
    if (!added) reader.fail("a label", "is there twice");
  }
}

// Returns the kind of the encoded specification: the oldest kind that contains all of its values.
BytesKind kind_of(const SceneSpec& spec) {
  if (spec.cell_size != 0) return BytesKind::kSizedSpec;
  if (spec.idle_ttl_s != 0 || spec.mesh_grace_s != 0) return BytesKind::kLimitedSpec;
  return spec.creator.empty() ? BytesKind::kSceneSpec : BytesKind::kOwnedSpec;
}

bool has_lifetimes(BytesKind kind) { return kind == BytesKind::kLimitedSpec || kind == BytesKind::kSizedSpec; }

void read_cell_size(ByteReader& reader, SceneSpec& spec) {
  spec.cell_size = reader.real("the cell size");
  if (!(spec.cell_size >= kMinCellSize && spec.cell_size <= kMaxCellSize))
    reader.fail("the cell size", "is out of range");
}

void read_lifetimes(ByteReader& reader, SceneSpec& spec) {
  const ByteReader::Pair lifetimes = reader.pair("the lifetimes");
  if (std::max(lifetimes.first, lifetimes.second) > limits::kMaxLifetimeSeconds)
    reader.fail("a lifetime", "is out of range");
  spec.idle_ttl_s = lifetimes.first;
  spec.mesh_grace_s = lifetimes.second;
}

}  // namespace

std::string encode_spec(const SceneSpec& spec) {
  std::string bytes;
  ByteWriter writer(bytes);
  const BytesKind kind = kind_of(spec);
  write_kind(writer, kind);
  writer.number(static_cast<uint64_t>(spec.winding));
  writer.number(uint64_t{spec.history.ticks});
  writer.number(spec.history.bytes);
  writer.number(spec.pinned_bytes);
  writer.number(static_cast<uint64_t>(spec.overload));
  writer.number(static_cast<uint64_t>(spec.durability));
  writer.number(uint64_t{spec.labels.size()});
  for (const auto& [key, value] : spec.labels) {
    writer.text(key);
    writer.text(value);
  }
  if (kind != BytesKind::kSceneSpec) writer.text(spec.creator);
  if (has_lifetimes(kind)) writer.pair(spec.idle_ttl_s, spec.mesh_grace_s);
  if (kind == BytesKind::kSizedSpec) writer.number(spec.cell_size);
  return bytes;
}

absl::StatusOr<SceneSpec> decode_spec(absl::string_view bytes) {
  const AlignedBytes aligned(bytes);
  ByteReader reader(aligned.bytes());
  SceneSpec spec;
  const BytesKind kind = read_kind(reader);
  if (kind != BytesKind::kSceneSpec && kind != BytesKind::kOwnedSpec && !has_lifetimes(kind))
    reader.fail("the kind of a specification", "is not known");
  spec.winding = read_enum(reader, Winding::kClockwise, "the winding");
  spec.history.ticks = static_cast<uint32_t>(reader.number_upto(limits::kMaxHistoryTicks, "the ticks of the history"));
  spec.history.bytes = reader.number_upto(limits::kMaxHistoryBytes, "the bytes of the history");
  spec.pinned_bytes = reader.number("pinned_bytes");
  spec.overload = read_enum(reader, OverloadPolicy::kLatestWins, "the overload policy");
  spec.durability = read_enum(reader, Durability::kReplicated, "the durability");
  read_labels(reader, spec);
  if (kind != BytesKind::kSceneSpec) spec.creator = std::string(reader.text(limits::kMaxCreatorLength, "the creator"));
  if (has_lifetimes(kind)) read_lifetimes(reader, spec);
  if (kind == BytesKind::kSizedSpec) read_cell_size(reader, spec);
  reader.end("a specification");
  if (!reader.good()) return reader.status();
  return spec;
}

}  // namespace locus
