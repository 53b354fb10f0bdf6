#include "core/scene/log/record_codec.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/scene/log/batch_codec.h"

namespace locus {
namespace {

// Lower bounds of the encoded sizes. They limit the count that a damaged record can claim.
constexpr size_t kMinBatchBytes = 96;
constexpr size_t kMinPlacementBytes = 32 + 7 * 8;

Record::Joined read_joined(ByteReader& reader) {
  Record::Joined joined;
  const uint64_t count = reader.count(kMinBatchBytes, "the number of batches");
  joined.batches.reserve(count);
  for (uint64_t i = 0; i < count && reader.good(); ++i) {
    joined.batches.push_back(read_batch(reader));
    if (reader.good() && !may_join(joined.batches.front(), joined.batches.back()))
      reader.fail(absl::StrCat("batch ", i), "cannot have been joined");
  }
  if (reader.good() && count == 0) reader.fail("the number of batches", "is 0");
  return joined;
}

void write_placement(const PlacementColumns& place, absl::Span<const Id> ids, ByteWriter& writer) {
  writer.column(absl::MakeConstSpan(place.mesh->sha256()));
  writer.text(place.mesh->name());
  writer.column(ids);
  writer.column(place.translations);
  writer.column(place.rotations);
  writer.column(place.scales);
  writer.column(place.layers);
  writer.column(place.groups);
  writer.column(place.tags);
}

PlacementColumns read_placement(ByteReader& reader, BytesKind kind, MeshKey& mesh) {
  const auto sha256 = reader.column<uint8_t>("the name of a mesh's content");
  if (sha256.size() == mesh.sha256.size())
    std::copy(sha256.begin(), sha256.end(), mesh.sha256.begin());
  else
    reader.fail("the name of a mesh's content", "has a wrong length");
  if (kind == BytesKind::kNamedChange)
    mesh.name = std::string(reader.text(limits::kMaxNameLength, "the name of a mesh"));
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

Record::Change read_change(ByteReader& reader, BytesKind kind) {
  Record::Change read;
  read.change.remove_ids = reader.column<uint64_t>("remove_ids");
  read.change.remove_groups = reader.column<uint64_t>("remove_groups");
  const uint64_t count = reader.count(kMinPlacementBytes, "the number of placements");
  read.change.place.reserve(count);
  for (uint64_t i = 0; i < count && reader.good(); ++i)
    read.change.place.push_back(read_placement(reader, kind, read.meshes.emplace_back()));
  return read;
}

}  // namespace

void encode_batch(const UpdateBatch& batch, std::string& to) {
  ByteWriter writer(to);
  write_kind(writer, BytesKind::kBatch);
  write_batch(batch, writer);
}

void encode_joined(absl::Span<const UpdateBatch* const> batches, std::string& to) {
  ByteWriter writer(to);
  write_kind(writer, BytesKind::kJoinedBatches);
  writer.number(uint64_t{batches.size()});
  for (const UpdateBatch* batch : batches) write_batch(*batch, writer);
}

void encode_change(const StaticChange& change, absl::Span<const Id> placed, std::string& to) {
  ByteWriter writer(to);
  write_kind(writer, BytesKind::kNamedChange);
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
    record.content_ = read_batch(reader);
  } else if (kind == BytesKind::kJoinedBatches) {
    record.content_ = read_joined(reader);
  } else if (kind == BytesKind::kStaticChange || kind == BytesKind::kNamedChange) {
    record.content_ = read_change(reader, kind);
  } else {
    reader.fail("the kind of a record", "is not known");
  }
  reader.end("a record");
  if (!reader.good()) return reader.status();
  return record;
}

}  // namespace locus
