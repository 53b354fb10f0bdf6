// Functions for tests of a log and its data directory. They append records and write snapshots; the bytes of both are
// computed from the sequence numbers. They also read all data back and describe differences from the expected content.
// One thread at a time for each scene.
#ifndef LOCUS_TESTS_SUPPORT_STORED_LOG_H_
#define LOCUS_TESTS_SUPPORT_STORED_LOG_H_

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/scene/log/update_log.h"
#include "tests/support/random.h"
#include "tests/support/temporary_folder.h"

namespace locus::test {

// Returns at most `most` bytes, whose number and values are determined by `seed`.
inline std::string bytes_of(uint64_t seed, size_t most) {
  Random random(seed);
  std::string bytes(random.below(most + 1), '\0');
  for (char& byte : bytes) byte = static_cast<char>(random.next());
  return bytes;
}

// ChunkSource that returns the elements of a vector.
class ChunksFrom {
 public:
  explicit ChunksFrom(std::vector<std::string> chunks) : chunks_(std::move(chunks)) {}
  absl::StatusOr<std::optional<std::string>> operator()() const {
    if (next_ == chunks_.size()) return std::nullopt;
    return chunks_[next_++];
  }
  size_t asked() const { return next_; }

 private:
  const std::vector<std::string> chunks_;
  mutable size_t next_ = 0;  // mutable, because the caller's FunctionRef calls the const operator()
};

// The next two functions return the default content of the scene's record `sequence`, and of the scene's snapshot at
// `sequence`.
inline std::string record_bytes(SceneKey scene, uint64_t sequence, size_t most = 200) {
  return bytes_of(scene * 1'000'003 + sequence, most);
}
inline std::vector<std::string> snapshot_chunks(SceneKey scene, uint64_t sequence, size_t count = 3,
                                                size_t most = 300) {
  std::vector<std::string> chunks;
  for (size_t i = 0; i < count; ++i) chunks.push_back(bytes_of(scene * 7919 + sequence * 31 + i + 1, most));
  return chunks;
}
inline LogEntry entry_of(uint64_t epoch, uint64_t sequence, const std::string& bytes) {
  LogEntry entry;
  entry.epoch = epoch;
  entry.writer = sequence % 5;
  entry.batch = sequence + 1000;
  entry.bytes = bytes;
  return entry;
}

// Appends the scene's next `count` records, each record by a separate call.
inline absl::Status append_records(UpdateLog& log, SceneKey scene, uint64_t epoch, uint64_t count,
                                   AckLevel level = AckLevel::kLocal, size_t most = 200) {
  for (uint64_t i = 0; i < count; ++i) {
    const absl::StatusOr<uint64_t> last = log.latest(scene);
    if (!last.ok()) return last.status();
    const std::string bytes = record_bytes(scene, *last + 1, most);
    const LogEntry entry = entry_of(epoch, *last + 1, bytes);
    const absl::StatusOr<uint64_t> got = log.append(scene, {&entry, 1}, level);
    if (!got.ok()) return got.status();
    if (*got != *last + 1) return absl::InternalError(absl::StrCat("got number ", *got, " after ", *last));
  }
  return absl::OkStatus();
}

// Reads the scene's records from sequence number `from` to the last one. Returns a description of a record that differs
// from the record that append_records() writes; empty if there is none. Sets `last` to the last sequence number read.
inline std::string record_difference(const UpdateLog& log, SceneKey scene, uint64_t from, uint64_t& last,
                                     size_t most = 200) {
  std::string difference;
  last = from - 1;
  const absl::Status status = log.read(scene, from, [&](const LogRecord& record) {
    if (record.sequence != last + 1) difference = absl::StrCat("record ", record.sequence, " after ", last);
    last = record.sequence;
    if (record.entry.bytes != record_bytes(scene, last, most)) difference = absl::StrCat("bytes of record ", last);
    if (record.entry.batch != last + 1000 || record.entry.writer != last % 5)
      difference = absl::StrCat("batch of record ", last);
    return absl::OkStatus();
  });
  return status.ok() ? difference : std::string(status.message());
}

inline absl::StatusOr<std::vector<std::string>> read_snapshot(const UpdateLog& log, SceneKey scene) {
  std::vector<std::string> chunks;
  absl::Status status = log.read_snapshot(scene, [&](absl::string_view chunk) {
    chunks.emplace_back(chunk);
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  return chunks;
}

inline absl::StatusOr<std::vector<std::string>> read_mesh(const UpdateLog& log, const std::array<uint8_t, 32>& sha256) {
  std::vector<std::string> chunks;
  absl::Status status = log.read_mesh(sha256, [&](absl::string_view chunk) {
    chunks.emplace_back(chunk);
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  return chunks;
}

inline absl::StatusOr<std::vector<std::string>> read_parts(const UpdateLog& log, absl::string_view name) {
  std::vector<std::string> chunks;
  absl::Status status = log.read_parts(name, [&](absl::string_view chunk) {
    chunks.emplace_back(chunk);
    return absl::OkStatus();
  });
  if (!status.ok()) return status;
  return chunks;
}

inline std::array<uint8_t, 32> hash_of(uint8_t number) {
  std::array<uint8_t, 32> sha256 = {};
  sha256[0] = number;
  sha256[31] = 0xFF;
  return sha256;
}

// Creates a scene whose snapshot is snapshot_chunks(expected, 0). `expected` must be the key that the log will assign:
// keys are assigned in ascending order, from 1 in a new directory.
inline absl::StatusOr<SceneKey> create_scene(UpdateLog& log, const std::string& name, SceneKey expected,
                                             uint64_t epoch = 7) {
  ChunksFrom state(snapshot_chunks(expected, 0));
  return log.create_scene(name, "spec of " + name, epoch, state);
}

inline absl::Status write_snapshot(UpdateLog& log, SceneKey scene, uint64_t sequence) {
  ChunksFrom state(snapshot_chunks(scene, sequence));
  return log.write_snapshot(scene, sequence, state);
}

inline const StoredScene* find_stored(const UpdateLog& log, absl::string_view name) {
  for (const StoredScene& scene : log.stored_scenes()) {
    if (scene.name == name) return &scene;
  }
  return nullptr;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_STORED_LOG_H_
