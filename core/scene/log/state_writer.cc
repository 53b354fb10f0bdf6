#include "core/scene/log/state_writer.h"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "core/base/check.h"
#include "core/scene/log/byte_codec.h"
#include "core/scene/log/mesh_codec.h"

namespace locus {
namespace {

// Size in bytes after which no further writer is added to a chunk. The last writer of a chunk may exceed this size.
constexpr size_t kWritersChunk = UpdateLog::kMaxChunkBytes / 2;
static_assert(kWritersChunk + size_t{limits::kMaxListedItemErrors} * kMaxBytesOfError + 1024 <=
              UpdateLog::kMaxChunkBytes);
static_assert(kObjectsPerChunk * kMaxBytesOfObject + 1024 <= UpdateLog::kMaxChunkBytes);
static_assert(kLifetimesPerChunk * 16 + limits::kMaxLeases * 32 + 1024 <= UpdateLog::kMaxChunkBytes);
static_assert(kPartsPerChunk * kMaxBytesOfPart + 1024 <= UpdateLog::kMaxChunkBytes);
static_assert(kInstancesPerChunk * kMaxBytesOfInstance + 1024 <= UpdateLog::kMaxChunkBytes);

void write_ack(const UpdateAck& ack, bool names_messages, ByteWriter& writer) {
  writer.number(ack.epoch);
  writer.number(ack.revision);
  writer.number(ack.tick);
  writer.pair(ack.applied, ack.refused);
  writer.number(uint64_t{ack.errors.size()});
  for (const ItemError& error : ack.errors) {
    writer.pair(error.index, static_cast<uint32_t>(error.reason));
    writer.number(error.id);
    if (names_messages) writer.number(uint64_t{error.message});
    writer.text(error.field);
  }
}

// Writes one column, whose entry for each item is the array of values that get(item) returns.
template <class Items, class Get>
void write_each(ByteWriter& writer, const Items& items, const Get& get) {
  using Entry = std::decay_t<decltype(get(items[0]))>;
  using Value = typename Entry::value_type;
  std::vector<Entry> entries;
  entries.reserve(items.size());
  for (const auto& item : items) entries.push_back(get(item));
  constexpr size_t kWidth = std::tuple_size_v<Entry>;
  writer.shared_column(absl::MakeConstSpan(reinterpret_cast<const Value*>(entries.data()), entries.size() * kWidth),
                       kWidth);
}

template <class T, size_t N>
using Values = std::array<T, N>;

template <class Items>
void write_labels(ByteWriter& writer, const Items& items) {
  write_each(writer, items, [](const auto& item) { return Values<uint64_t, 1>{item.id}; });
  write_each(writer, items, [](const auto& item) { return Values<uint64_t, 1>{item.group}; });
  write_each(writer, items, [](const auto& item) { return Values<uint64_t, 1>{item.tag}; });
  write_each(writer, items, [](const auto& item) { return Values<uint32_t, 1>{item.layers}; });
}

Values<double, 3> components(const Vec3d& v) { return {v.x, v.y, v.z}; }
Values<float, 3> components(const Vec3f& v) { return {v.x, v.y, v.z}; }
Values<float, 4> components(const Quaternion& q) { return {q.x, q.y, q.z, q.w}; }

void write_objects(ByteWriter& writer, const std::vector<Object>& objects) {
  write_labels(writer, objects);
  write_each(writer, objects,
             [](const Object& object) { return Values<uint8_t, 1>{static_cast<uint8_t>(object.shape.kind)}; });
  write_each(writer, objects, [](const Object& object) { return components(object.shape.position); });
  write_each(writer, objects, [](const Object& object) { return components(object.shape.rotation); });
  write_each(writer, objects, [](const Object& object) { return components(object.shape.size); });
  write_each(writer, objects, [](const Object& object) { return Values<float, 1>{object.shape.radius}; });
}

}  // namespace

StateWriter::StateWriter(FrozenScene scene) : scene_(std::move(scene)), writers_(scene_.writers.writers()) {
  LOCUS_DCHECK(scene_.snapshot != nullptr);
  const Bvh<Instance>::Values instances = scene_.snapshot->statics->tree().values();
  next_instance_ = instances.begin();
  last_instance_ = instances.end();
  for (size_t i = 0; compounds() != nullptr && i < compounds()->size(); ++i)
    compound_count_ += (*compounds())[i] != nullptr ? 1 : 0;
  for (const WriterTable::Writer& writer : writers_)
    for (const ItemError& error : writer.ack.errors) names_messages_ |= error.message != 0;
}

absl::StatusOr<std::optional<std::string>> StateWriter::next() {
  std::string chunk;
  if (!std::exchange(begun_, true)) {
    chunk = header();
  } else if (next_writer_ < writers_.size()) {
    chunk = next_writers();
  } else if (next_instance_ != last_instance_) {
    chunk = next_instances();
  } else if (compound_numbers_.size() < compound_count_) {
    chunk = next_compounds();
  } else if (objects_written_ < scene_.snapshot->objects.size()) {
    chunk = next_objects();
  } else if (scene_.snapshot->expiries != nullptr && expiries_written_ < scene_.snapshot->expiries->count()) {
    chunk = next_expiries();
  } else if (next_lease_ < scene_.leases.leases.size()) {
    chunk = next_leases();
  } else {
    return std::optional<std::string>();
  }
  LOCUS_CHECK_LE(chunk.size(), UpdateLog::kMaxChunkBytes);
  bytes_ += chunk.size();
  return std::optional<std::string>(std::move(chunk));
}

std::string StateWriter::header() const {
  std::string chunk;
  ByteWriter writer(chunk);
  const size_t expiries = scene_.snapshot->expiries == nullptr ? 0 : scene_.snapshot->expiries->count();
  const bool extended = expiries != 0 || !scene_.leases.leases.empty();
  write_kind(writer, extended ? BytesKind::kExtendedHeader : BytesKind::kStateHeader);
  writer.number(scene_.snapshot->epoch);
  writer.number(scene_.snapshot->revision);
  writer.number(scene_.snapshot->tick);
  writer.number(uint64_t{scene_.has_past});
  writer.number(uint64_t{writers_.size()});
  writer.number(uint64_t{scene_.snapshot->statics->size()});
  writer.number(uint64_t{scene_.snapshot->objects.size()});
  writer.number(scene_.snapshot->objects.grid().cell_size());
  if (!extended) return chunk;
  writer.number(uint64_t{expiries});
  writer.number(uint64_t{scene_.leases.leases.size()});
  return chunk;
}

std::string StateWriter::next_writers() {
  std::string chunk;
  ByteWriter writer(chunk);
  write_kind(writer, names_messages_ ? BytesKind::kMessageWriters : BytesKind::kStateWriters);
  for (; next_writer_ < writers_.size() && chunk.size() < kWritersChunk; ++next_writer_) {
    const WriterTable::Writer& entry = writers_[next_writer_];
    writer.number(entry.number);
    writer.number(entry.batch);
    writer.number(entry.heard);
    write_ack(entry.ack, names_messages_, writer);
  }
  return chunk;
}

std::string StateWriter::next_instances() {
  std::vector<Instance> chunk_instances;
  for (; next_instance_ != last_instance_ && chunk_instances.size() < kInstancesPerChunk; ++next_instance_)
    chunk_instances.push_back(*next_instance_);
  const absl::Span<const Instance> instances = chunk_instances;
  absl::flat_hash_map<const StaticMesh*, uint32_t> mesh_indices;
  std::vector<Sha256> contents;
  std::vector<absl::string_view> names;
  std::vector<std::array<float, 6>> bounds;
  for (const Instance& instance : instances) {
    if (!mesh_indices.emplace(instance.mesh.get(), static_cast<uint32_t>(contents.size())).second) continue;
    contents.push_back(instance.mesh->sha256());
    names.emplace_back(instance.mesh->name());
    bounds.push_back(encode_bounds(instance.mesh->bounds()));
  }
  std::string chunk;
  ByteWriter writer(chunk);
  write_kind(writer, BytesKind::kBoundedInstances);
  writer.column(absl::MakeConstSpan(contents));
  for (const absl::string_view name : names) writer.text(name);
  writer.column(absl::MakeConstSpan(bounds));
  write_labels(writer, instances);
  write_each(writer, instances,
             [&](const Instance& one) { return Values<uint32_t, 1>{mesh_indices.at(one.mesh.get())}; });
  write_each(writer, instances, [](const Instance& one) { return components(one.transform.translation); });
  write_each(writer, instances, [](const Instance& one) { return components(one.transform.quaternion); });
  write_each(writer, instances, [](const Instance& one) { return Values<float, 1>{one.transform.scale}; });
  return chunk;
}

std::string StateWriter::next_compounds() {
  std::vector<uint8_t> counts;
  std::vector<Part> parts;
  for (; next_compound_ < compounds()->size() && parts.size() + limits::kMaxParts <= kPartsPerChunk; ++next_compound_) {
    const Compound* const compound = (*compounds())[next_compound_].get();
    if (compound == nullptr) continue;
    compound_numbers_.emplace(compound, static_cast<uint32_t>(compound_numbers_.size()));
    counts.push_back(static_cast<uint8_t>(compound->parts().size()));
    parts.insert(parts.end(), compound->parts().begin(), compound->parts().end());
  }
  std::string chunk;
  ByteWriter writer(chunk);
  write_kind(writer, BytesKind::kStateCompounds);
  writer.number(compound_count_);
  writer.column(absl::MakeConstSpan(counts));
  write_each(writer, parts, [](const Part& part) { return Values<uint8_t, 1>{static_cast<uint8_t>(part.kind)}; });
  write_each(writer, parts, [](const Part& part) { return components(part.position); });
  write_each(writer, parts, [](const Part& part) { return components(part.rotation); });
  write_each(writer, parts, [](const Part& part) { return components(part.size); });
  write_each(writer, parts, [](const Part& part) { return Values<float, 1>{part.radius}; });
  write_each(writer, parts, [](const Part& part) { return Values<uint32_t, 1>{part.layers}; });
  return chunk;
}

std::string StateWriter::next_objects() {
  std::vector<Object> objects;
  objects.reserve(kObjectsPerChunk);
  scene_.snapshot->objects.for_each_from(next_object_, [&](const Object& object) {
    objects.push_back(object);
    return objects.size() < kObjectsPerChunk;
  });
  LOCUS_CHECK(!objects.empty());
  objects_written_ += objects.size();
  LOCUS_DCHECK_LE(objects_written_, scene_.snapshot->objects.size());
  std::string chunk;
  ByteWriter writer(chunk);
  const bool has_compounds =
      std::any_of(objects.begin(), objects.end(), [](const Object& object) { return object.compound != nullptr; });
  write_kind(writer, has_compounds ? BytesKind::kCompoundObjects : BytesKind::kStateObjects);
  write_objects(writer, objects);
  if (has_compounds)
    write_each(writer, objects, [this](const Object& object) {
      return Values<uint32_t, 1>{object.compound == nullptr ? kNoCompound : compound_numbers_.at(object.compound)};
    });
  return chunk;
}

std::string StateWriter::next_expiries() {
  std::vector<Id> ids;
  std::vector<uint64_t> remaining;
  scene_.snapshot->objects.grid().for_each_from(next_expiry_, [&](const GridRef& object) {
    const uint64_t ticks = scene_.snapshot->remaining_ticks(object.handle());
    if (ticks == 0) return true;
    ids.push_back(object.entry().id);
    remaining.push_back(ticks);
    return ids.size() < kLifetimesPerChunk;
  });
  LOCUS_CHECK(!ids.empty());
  expiries_written_ += ids.size();
  LOCUS_DCHECK_LE(expiries_written_, scene_.snapshot->expiries->count());
  std::string chunk;
  ByteWriter writer(chunk);
  write_kind(writer, BytesKind::kStateExpiries);
  writer.column(absl::MakeConstSpan(ids));
  writer.shared_column(absl::MakeConstSpan(remaining), 1);
  return chunk;
}

std::string StateWriter::next_leases() {
  std::string chunk;
  ByteWriter writer(chunk);
  write_kind(writer, BytesKind::kStateLeases);
  size_t room = kLifetimesPerChunk;
  while (room > 0 && next_lease_ < scene_.leases.leases.size()) {
    const Lease& lease = scene_.leases.leases[next_lease_];
    if (leased_.empty())
      scene_.leases.objects.for_each(lease.writer, [this](uint32_t handle) {
        leased_.push_back(scene_.snapshot->objects.grid().at(handle).entry().id);
        return true;
      });
    const size_t count = std::min(room, leased_.size());
    writer.number(lease.writer);
    writer.number(uint64_t{lease.lease_ms});
    writer.number(uint64_t{leased_.size() - count});  // number of objects of the lease in later chunks
    writer.column(absl::MakeConstSpan(leased_).last(count));
    leased_.resize(leased_.size() - count);
    room -= count;
    if (leased_.empty()) ++next_lease_;
  }
  return chunk;
}

}  // namespace locus
