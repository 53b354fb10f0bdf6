#include "core/scene/spec_codec.h"

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

}  // namespace

std::string encode_spec(const SceneSpec& spec) {
  std::string bytes;
  ByteWriter writer(bytes);
  write_kind(writer, spec.creator.empty() ? BytesKind::kSceneSpec : BytesKind::kOwnedSpec);
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
  if (!spec.creator.empty()) writer.text(spec.creator);
  return bytes;
}

absl::StatusOr<SceneSpec> decode_spec(absl::string_view bytes) {
  const AlignedBytes aligned(bytes);
  ByteReader reader(aligned.bytes());
  SceneSpec spec;
  const BytesKind kind = read_kind(reader);
  if (kind != BytesKind::kSceneSpec && kind != BytesKind::kOwnedSpec)
    reader.fail("the kind of a specification", "is not known");
  spec.winding = read_enum(reader, Winding::kClockwise, "the winding");
  spec.history.ticks = static_cast<uint32_t>(reader.number_upto(limits::kMaxHistoryTicks, "the ticks of the history"));
  spec.history.bytes = reader.number_upto(limits::kMaxHistoryBytes, "the bytes of the history");
  spec.pinned_bytes = reader.number("pinned_bytes");
  spec.overload = read_enum(reader, OverloadPolicy::kLatestWins, "the overload policy");
  spec.durability = read_enum(reader, Durability::kMemory, "the durability");
  read_labels(reader, spec);
  if (kind == BytesKind::kOwnedSpec) spec.creator = std::string(reader.text(limits::kMaxCreatorLength, "the creator"));
  reader.end("a specification");
  if (!reader.good()) return reader.status();
  return spec;
}

}  // namespace locus
