// An update log without a disk: keeps everything in memory and tracks synced records, so that a test can simulate a
// crash. A test can make calls fail or wait. Checks that callers obey the rules of the interface.
#ifndef LOCUS_TESTS_SUPPORT_MEMORY_LOG_H_
#define LOCUS_TESTS_SUPPORT_MEMORY_LOG_H_

#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/mutex.h"
#include "core/scene/log/update_log.h"

namespace locus::test {

class MemoryLog : public UpdateLog {
 public:
  using Bytes = std::shared_ptr<const std::string>;
  struct Record {
    uint64_t epoch = 0, writer = 0, batch = 0;
    Bytes bytes;
  };
  struct KeptScene {
    std::string name, spec;
    uint64_t epoch = 0;
    uint64_t snapshot_sequence = 0;
    std::vector<Bytes> snapshot;
    std::vector<Record> records;    // records after the snapshot
    uint64_t synced = 0;            // sequence number of the last synced record
    std::vector<Record> left_over;  // records of a failed append, which may be in the log after a crash
    uint64_t last() const { return snapshot_sequence + records.size(); }
  };
  struct Kept {
    std::map<SceneKey, KeptScene> scenes;
    std::map<std::string, std::array<uint8_t, 32>> meshes;
    std::map<std::string, uint32_t> mesh_graces;
    std::map<std::array<uint8_t, 32>, std::vector<Bytes>> contents;
    std::map<std::string, std::vector<Bytes>> parts;  // parts of each mesh, by name; no entry for a mesh of format 1
    std::map<std::array<uint8_t, 32>, std::string> topologies;
    SceneKey last_key = 0;
  };

  MemoryLog() = default;
  explicit MemoryLog(const Kept& kept) : kept_(kept) { list_stored(kept); }

  // Returns the data that remains if the machine stops now. A scene keeps its synced records and the first `unsynced`
  // of its unsynced records. If the scene keeps all of its records, and its last append failed, it also keeps the first
  // `left_over` records of the failed append.
  Kept crash(uint64_t unsynced = 0, uint64_t left_over = 0) const {
    const MutexLock lock(mutex_);
    Kept kept = kept_;
    for (auto& [key, scene] : kept.scenes) {
      const bool all = scene.synced + unsynced >= scene.last();
      while (scene.last() > scene.synced + unsynced) scene.records.pop_back();
      for (size_t i = 0; all && i < std::min<uint64_t>(left_over, scene.left_over.size()); ++i)
        scene.records.push_back(scene.left_over[i]);
      scene.left_over.clear();
      scene.synced = scene.last();
    }
    return kept;
  }
  // Makes every call that writes fail with `status` until the next call of fail_with(); OK ends the failures.
  void fail_with(const absl::Status& status) {
    const MutexLock lock(mutex_);
    failure_ = status;
  }
  // Like fail_with(), but only set_mesh_graces() fails.
  void fail_marks_with(const absl::Status& status) {
    const MutexLock lock(mutex_);
    mark_failure_ = status;
  }
  // Makes create_scene(), delete_scene(), append() and delete_mesh() wait until release().
  void hold() {
    const MutexLock lock(mutex_);
    held_ = true;
  }
  void release() {
    const MutexLock lock(mutex_);
    held_ = false;
    released_.notify_all();
  }
  // Waits until a call is blocked by hold().
  void wait_for_writer() {
    const MutexLock lock(mutex_);
    while (waiting_ == 0) released_.wait(mutex_);
  }
  // Sets the time that each append takes.
  void take(std::chrono::microseconds duration) { duration_ = duration.count(); }
  uint64_t appends() const { return appends_; }

  const std::vector<StoredScene>& stored_scenes() const override { return stored_scenes_; }
  const std::vector<StoredMesh>& stored_meshes() const override { return stored_meshes_; }
  absl::Status catalogue_damage() const override { return absl::OkStatus(); }
  bool closed_in_order() const override { return false; }

  absl::StatusOr<SceneKey> create_scene(absl::string_view name, absl::string_view spec, uint64_t epoch,
                                        ChunkSource state) override {
    absl::StatusOr<std::vector<Bytes>> chunks = all_of(state);
    if (!chunks.ok()) return chunks.status();
    const MutexLock lock(mutex_);
    wait_while_held();
    if (!failure_.ok()) return failure_;
    for (const auto& [key, scene] : kept_.scenes) LOCUS_CHECK(scene.name != name);
    KeptScene& scene = kept_.scenes[++kept_.last_key];
    scene.name = std::string(name);
    scene.spec = std::string(spec);
    scene.epoch = epoch;
    scene.snapshot = *std::move(chunks);
    return kept_.last_key;
  }

  absl::Status delete_scene(SceneKey key) override {
    const MutexLock lock(mutex_);
    wait_while_held();
    if (!failure_.ok()) return failure_;
    return kept_.scenes.erase(key) == 1 ? absl::OkStatus() : absl::NotFoundError("no such scene");
  }

  absl::Status restart_scene(SceneKey key, uint64_t epoch) override {
    const MutexLock lock(mutex_);
    if (!failure_.ok()) return failure_;
    kept_.scenes.at(key).epoch = epoch;
    return absl::OkStatus();
  }

  absl::Status set_scene_spec(SceneKey key, absl::string_view spec) override {
    const MutexLock lock(mutex_);
    if (!failure_.ok()) return failure_;
    kept_.scenes.at(key).spec = std::string(spec);
    return absl::OkStatus();
  }

  absl::StatusOr<uint64_t> append(SceneKey key, absl::Span<const LogEntry> entries, AckLevel level) override {
    LOCUS_CHECK(!entries.empty());
    std::vector<Record> records;
    for (const LogEntry& entry : entries) {
      LOCUS_CHECK_LE(entry.bytes.size(), kMaxRecordBytes);
      records.push_back({entry.epoch, entry.writer, entry.batch, std::make_shared<std::string>(entry.bytes)});
    }
    if (duration_ > 0) std::this_thread::sleep_for(std::chrono::microseconds(duration_));
    ++appends_;
    const MutexLock lock(mutex_);
    wait_while_held();
    const auto found = kept_.scenes.find(key);
    if (found == kept_.scenes.end()) return absl::NotFoundError("no such scene");
    KeptScene& scene = found->second;
    scene.left_over.clear();
    if (!failure_.ok()) {
      scene.left_over = std::move(records);
      return failure_;
    }
    scene.records.insert(scene.records.end(), records.begin(), records.end());
    if (level == AckLevel::kLocal) scene.synced = scene.last();
    return scene.last();
  }

  absl::Status read(SceneKey key, uint64_t from, RecordSink sink) const override {
    KeptScene scene;
    {
      const MutexLock lock(mutex_);
      scene = kept_.scenes.at(key);
    }
    LOCUS_CHECK_LT(scene.snapshot_sequence, from);
    for (uint64_t sequence = from; sequence <= scene.last(); ++sequence) {
      const Record& record = scene.records[sequence - scene.snapshot_sequence - 1];
      if (absl::Status status = sink({sequence, {record.epoch, record.writer, record.batch, *record.bytes}});
          !status.ok())
        return status;
    }
    return absl::OkStatus();
  }

  absl::StatusOr<uint64_t> latest(SceneKey key) const override {
    const MutexLock lock(mutex_);
    return kept_.scenes.at(key).last();
  }

  absl::Status write_snapshot(SceneKey key, uint64_t sequence, ChunkSource state) override {
    absl::StatusOr<std::vector<Bytes>> chunks = all_of(state);
    if (!chunks.ok()) return chunks.status();
    const MutexLock lock(mutex_);
    if (!failure_.ok()) return failure_;
    const auto found = kept_.scenes.find(key);
    if (found == kept_.scenes.end()) return absl::NotFoundError("no such scene");
    KeptScene& scene = found->second;
    LOCUS_CHECK_LE(scene.snapshot_sequence, sequence);
    LOCUS_CHECK_LE(sequence, scene.last());
    scene.records.erase(scene.records.begin(),
                        scene.records.begin() + static_cast<std::ptrdiff_t>(sequence - scene.snapshot_sequence));
    scene.snapshot_sequence = sequence;
    scene.snapshot = *std::move(chunks);
    scene.synced = std::max(scene.synced, sequence);
    return absl::OkStatus();
  }

  absl::Status read_snapshot(SceneKey key, ChunkSink sink) const override {
    std::vector<Bytes> chunks;
    {
      const MutexLock lock(mutex_);
      chunks = kept_.scenes.at(key).snapshot;
    }
    return give(chunks, sink);
  }

  absl::Status add_mesh(absl::string_view name, const std::array<uint8_t, 32>& sha256, ChunkSource content,
                        ChunkSource parts) override {
    std::vector<Bytes> chunks;
    if (!knows(sha256)) {
      absl::StatusOr<std::vector<Bytes>> all = all_of(content);
      if (!all.ok()) return all.status();
      chunks = *std::move(all);
    }
    absl::StatusOr<std::vector<Bytes>> own = all_of(parts);
    if (!own.ok()) return own.status();
    const MutexLock lock(mutex_);
    if (!failure_.ok()) return failure_;
    LOCUS_CHECK(kept_.meshes.emplace(name, sha256).second);
    kept_.parts.emplace(name, *std::move(own));
    kept_.contents.emplace(sha256, std::move(chunks));
    return absl::OkStatus();
  }

  absl::Status delete_mesh(absl::string_view name) override {
    const MutexLock lock(mutex_);
    wait_while_held();
    if (!failure_.ok()) return failure_;
    const auto found = kept_.meshes.find(std::string(name));
    if (found == kept_.meshes.end()) return absl::NotFoundError("no such mesh");
    const std::array<uint8_t, 32> sha256 = found->second;
    kept_.meshes.erase(found);
    kept_.parts.erase(std::string(name));
    kept_.mesh_graces.erase(std::string(name));
    const bool used = std::any_of(kept_.meshes.begin(), kept_.meshes.end(),
                                  [&sha256](const auto& mesh) { return mesh.second == sha256; });
    if (!used) kept_.contents.erase(sha256);
    if (!used) kept_.topologies.erase(sha256);
    return absl::OkStatus();
  }

  absl::Status set_mesh_graces(absl::Span<const std::string> names, uint32_t grace_s) override {
    const MutexLock lock(mutex_);
    if (!failure_.ok()) return failure_;
    if (!mark_failure_.ok()) return mark_failure_;
    for (const std::string& name : names)
      if (!kept_.meshes.contains(name)) return absl::NotFoundError("no such mesh");
    ++grace_writes_;
    for (const std::string& name : names) kept_.mesh_graces[name] = grace_s;
    return absl::OkStatus();
  }
  // Returns the number of successful calls of set_mesh_graces().
  uint64_t grace_writes() const {
    const MutexLock lock(mutex_);
    return grace_writes_;
  }

  absl::Status read_mesh(const std::array<uint8_t, 32>& sha256, ChunkSink sink) const override {
    std::vector<Bytes> chunks;
    {
      const MutexLock lock(mutex_);
      const auto found = kept_.contents.find(sha256);
      if (found == kept_.contents.end()) return absl::DataLossError("no such content");
      chunks = found->second;
    }
    return give(chunks, sink);
  }

  absl::Status read_parts(absl::string_view name, ChunkSink sink) const override {
    std::vector<Bytes> chunks;
    {
      const MutexLock lock(mutex_);
      const auto found = kept_.parts.find(std::string(name));
      if (found == kept_.parts.end()) return absl::DataLossError("no such parts");
      chunks = found->second;
    }
    return give(chunks, sink);
  }

  void store_topology(const std::array<uint8_t, 32>& sha256, absl::string_view bytes) override {
    const MutexLock lock(mutex_);
    if (failure_.ok()) kept_.topologies[sha256] = std::string(bytes);
  }
  std::optional<std::string> read_topology(const std::array<uint8_t, 32>& sha256) const override {
    const MutexLock lock(mutex_);
    const auto found = kept_.topologies.find(sha256);
    return found == kept_.topologies.end() ? std::nullopt : std::optional(found->second);
  }

  absl::Status back_up(const std::string&) override { return absl::UnimplementedError("nowhere to go"); }

 private:
  void wait_while_held() LOCUS_REQUIRES(mutex_) {
    ++waiting_;
    if (held_) released_.notify_all();
    while (held_) released_.wait(mutex_);
    --waiting_;
  }

  static absl::StatusOr<std::vector<Bytes>> all_of(ChunkSource source) {
    std::vector<Bytes> chunks;
    while (true) {
      absl::StatusOr<std::optional<std::string>> chunk = source();
      if (!chunk.ok()) return chunk.status();
      if (!*chunk) return chunks;
      LOCUS_CHECK_LE((*chunk)->size(), kMaxChunkBytes);
      chunks.push_back(std::make_shared<std::string>(**std::move(chunk)));
    }
  }

  static absl::Status give(const std::vector<Bytes>& chunks, ChunkSink sink) {
    for (const Bytes& chunk : chunks)
      if (absl::Status status = sink(*chunk); !status.ok()) return status;
    return absl::OkStatus();
  }

  bool knows(const std::array<uint8_t, 32>& sha256) const {
    const MutexLock lock(mutex_);
    return kept_.contents.contains(sha256);
  }

  static uint32_t grace_of(const Kept& kept, const std::string& name) {
    const auto grace = kept.mesh_graces.find(name);
    return grace == kept.mesh_graces.end() ? 0 : grace->second;
  }

  void list_stored(const Kept& kept) {
    for (const auto& [key, scene] : kept.scenes) {
      uint64_t bytes = 0;
      for (const Record& record : scene.records) bytes += record.bytes->size();
      stored_scenes_.push_back(
          {key, scene.name, scene.spec, scene.epoch, scene.snapshot_sequence, scene.last(), bytes, false, {}});
    }
    for (const auto& [name, sha256] : kept.meshes)
      stored_meshes_.push_back({name, sha256, {}, grace_of(kept, name), !kept.parts.contains(name)});
  }

  mutable Mutex mutex_;
  Kept kept_ LOCUS_GUARDED_BY(mutex_);
  absl::Status failure_ LOCUS_GUARDED_BY(mutex_);
  absl::Status mark_failure_ LOCUS_GUARDED_BY(mutex_);
  uint64_t grace_writes_ LOCUS_GUARDED_BY(mutex_) = 0;
  ConditionVariable released_;
  bool held_ LOCUS_GUARDED_BY(mutex_) = false;
  int waiting_ LOCUS_GUARDED_BY(mutex_) = 0;
  std::atomic<int64_t> duration_{0};
  std::atomic<uint64_t> appends_{0};
  std::vector<StoredScene> stored_scenes_;
  std::vector<StoredMesh> stored_meshes_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_MEMORY_LOG_H_
