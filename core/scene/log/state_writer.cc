#include "core/scene/log/state_writer.h"

#include <algorithm>
#include <type_traits>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "core/base/check.h"
#include "core/scene/log/byte_codec.h"
#include "core/scene/log/state_limits.h"

namespace locus {
namespace {

// A chunk of writers ends after the one that takes it beyond this.
constexpr size_t kWritersChunk = UpdateLog::kMaxChunkBytes / 2;
static_assert(kWritersChunk + size_t{limits::kMaxListedItemErrors} * kMaxBytesOfError + 1024 <=
              UpdateLog::kMaxChunkBytes);
static_assert(kObjectsPerChunk * kMaxBytesOfObject + 1024 <= UpdateLog::kMaxChunkBytes);
static_assert(kInstancesPerChunk * kMaxBytesOfInstance + 1024 <= UpdateLog::kMaxChunkBytes);

void write_ack(const UpdateAck& ack, ByteWriter& writer) {
  writer.number(ack.epoch);
  writer.number(ack.revision);
  writer.number(ack.tick);
  writer.pair(ack.applied, ack.refused);
  writer.number(uint64_t{ack.errors.size()});
  for (const ItemError& error : ack.errors) {
    writer.pair(error.index, static_cast<uint32_t>(error.reason));
    writer.number(error.id);
    writer.text(error.field);
  }
}

// What get(thing) says of each thing, an array of N numbers, as one column.
template <class Things, class Get>
void write_each(ByteWriter& writer, const Things& things, const Get& get) {
  using Entry = std::decay_t<decltype(get(things[0]))>;
  using Number = typename Entry::value_type;
  std::vector<Entry> entries;
  entries.reserve(things.size());
  for (const auto& thing : things) entries.push_back(get(thing));
  constexpr size_t width = std::tuple_size_v<Entry>;
  writer.shared_column(absl::MakeConstSpan(reinterpret_cast<const Number*>(entries.data()), entries.size() * width),
                       width);
}

template <class T, size_t N>
using Numbers = std::array<T, N>;

template <class Things>
void write_labels(ByteWriter& writer, const Things& things) {
  write_each(writer, things, [](const auto& thing) { return Numbers<uint64_t, 1>{thing.id}; });
  write_each(writer, things, [](const auto& thing) { return Numbers<uint64_t, 1>{thing.group}; });
  write_each(writer, things, [](const auto& thing) { return Numbers<uint64_t, 1>{thing.tag}; });
  write_each(writer, things, [](const auto& thing) { return Numbers<uint32_t, 1>{thing.layers}; });
}

Numbers<double, 3> numbers(const Vec3d& v) { return {v.x, v.y, v.z}; }
Numbers<float, 3> numbers(const Vec3f& v) { return {v.x, v.y, v.z}; }
Numbers<float, 4> numbers(const Quaternion& q) { return {q.x, q.y, q.z, q.w}; }

void write_objects(ByteWriter& writer, const std::vector<Object>& objects) {
  write_labels(writer, objects);
  write_each(writer, objects,
             [](const Object& object) { return Numbers<uint8_t, 1>{static_cast<uint8_t>(object.shape.kind)}; });
  write_each(writer, objects, [](const Object& object) { return numbers(object.shape.position); });
  write_each(writer, objects, [](const Object& object) { return numbers(object.shape.rotation); });
  write_each(writer, objects, [](const Object& object) { return numbers(object.shape.size); });
  write_each(writer, objects, [](const Object& object) { return Numbers<float, 1>{object.shape.radius}; });
}

}  // namespace

StateWriter::StateWriter(FrozenScene scene) : scene_(std::move(scene)), writers_(scene_.writers.writers()) {}

absl::StatusOr<std::optional<std::string>> StateWriter::next() {
  std::string chunk;
  if (!std::exchange(begun_, true)) {
    chunk = header();
  } else if (next_writer_ < writers_.size()) {
    chunk = next_writers();
  } else if (next_instance_ < scene_.snapshot->statics->size()) {
    chunk = next_instances();
  } else if (objects_written_ < scene_.snapshot->objects.size()) {
    chunk = next_objects();
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
  write_kind(writer, BytesKind::kStateHeader);
  writer.number(scene_.snapshot->epoch);
  writer.number(scene_.snapshot->revision);
  writer.number(scene_.snapshot->tick);
  writer.number(uint64_t{scene_.has_past});
  writer.number(uint64_t{writers_.size()});
  writer.number(uint64_t{scene_.snapshot->statics->size()});
  writer.number(uint64_t{scene_.snapshot->objects.size()});
  writer.number(scene_.snapshot->objects.grid().cell_size());
  return chunk;
}

std::string StateWriter::next_writers() {
  std::string chunk;
  ByteWriter writer(chunk);
  write_kind(writer, BytesKind::kStateWriters);
  for (; next_writer_ < writers_.size() && chunk.size() < kWritersChunk; ++next_writer_) {
    const WriterTable::Writer& one = writers_[next_writer_];
    writer.number(one.number);
    writer.number(one.batch);
    writer.number(one.heard);
    write_ack(one.ack, writer);
  }
  return chunk;
}

std::string StateWriter::next_instances() {
  const absl::Span<const Instance> all = scene_.snapshot->statics->tree().values();
  const absl::Span<const Instance> things = all.subspan(next_instance_, kInstancesPerChunk);
  next_instance_ += things.size();
  absl::flat_hash_map<const StaticMesh*, uint32_t> numbers_of_meshes;
  std::vector<Sha256> contents;
  std::vector<absl::string_view> names;
  for (const Instance& instance : things) {
    if (!numbers_of_meshes.emplace(instance.mesh.get(), static_cast<uint32_t>(contents.size())).second) continue;
    contents.push_back(instance.mesh->sha256());
    names.push_back(instance.mesh->name());
  }
  std::string chunk;
  ByteWriter writer(chunk);
  write_kind(writer, BytesKind::kNamedInstances);
  writer.column(absl::MakeConstSpan(contents));
  for (const absl::string_view name : names) writer.text(name);
  write_labels(writer, things);
  write_each(writer, things,
             [&](const Instance& one) { return Numbers<uint32_t, 1>{numbers_of_meshes.at(one.mesh.get())}; });
  write_each(writer, things, [](const Instance& one) { return numbers(one.transform.translation); });
  write_each(writer, things, [](const Instance& one) { return numbers(one.transform.quaternion); });
  write_each(writer, things, [](const Instance& one) { return Numbers<float, 1>{one.transform.scale}; });
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
  std::string chunk;
  ByteWriter writer(chunk);
  write_kind(writer, BytesKind::kStateObjects);
  write_objects(writer, objects);
  return chunk;
}

}  // namespace locus
