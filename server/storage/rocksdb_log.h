// UpdateLog in RocksDB: the durable log of one machine. How a data directory is laid out, what damage it notices and
// what is done about it: README.md in this folder.
//
// Threads: as of UpdateLog. One thread of its own brings records of AckLevel::kMemory to the disk, keeps HIGH_WATER up
// to date, watches the room on the disk, and gets the database over errors of the disk, within a second of their end.
#ifndef LOCUS_SERVER_STORAGE_ROCKSDB_LOG_H_
#define LOCUS_SERVER_STORAGE_ROCKSDB_LOG_H_

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/mutex.h"
#include "core/scene/log/update_log.h"
#include "server/storage/integrity/opening.h"
#include "server/storage/integrity/scene_table.h"
#include "server/storage/rocksdb/catalogue.h"
#include "server/storage/rocksdb/storage_options.h"
#include "server/storage/rocksdb/topology_files.h"

namespace locus::server {

class RocksdbLog final : public UpdateLog {
 public:
  // A directory that does not exist or is empty becomes an empty log. Damaged scenes and meshes are among the stored
  // ones, and say so. FAILED_PRECONDITION where another process has it open or another version wrote it; DATA_LOSS
  // where nothing can be had from it; UNAVAILABLE or RESOURCE_EXHAUSTED for what the disk says.
  static absl::StatusOr<std::unique_ptr<RocksdbLog>> open(const StorageOptions& options);
  // In order: everything is on the disk afterwards.
  ~RocksdbLog() override;
  RocksdbLog(const RocksdbLog&) = delete;
  RocksdbLog& operator=(const RocksdbLog&) = delete;

  const std::vector<StoredScene>& stored_scenes() const override { return stored_scenes_; }
  const std::vector<StoredMesh>& stored_meshes() const override { return stored_meshes_; }
  absl::Status catalogue_damage() const override { return catalogue_damage_; }
  bool closed_in_order() const override { return closed_in_order_; }

  absl::StatusOr<SceneKey> create_scene(absl::string_view name, absl::string_view spec, uint64_t epoch,
                                        ChunkSource state) override LOCUS_EXCLUDES(catalogue_mutex_);
  absl::Status delete_scene(SceneKey scene) override LOCUS_EXCLUDES(catalogue_mutex_);
  absl::Status restart_scene(SceneKey scene, uint64_t epoch) override LOCUS_EXCLUDES(catalogue_mutex_);

  absl::StatusOr<uint64_t> append(SceneKey scene, absl::Span<const LogEntry> entries, AckLevel level) override;
  absl::Status read(SceneKey scene, uint64_t from, RecordSink sink) const override LOCUS_EXCLUDES(catalogue_mutex_);
  absl::StatusOr<uint64_t> latest(SceneKey scene) const override;

  absl::Status write_snapshot(SceneKey scene, uint64_t sequence, ChunkSource state) override
      LOCUS_EXCLUDES(catalogue_mutex_);
  absl::Status read_snapshot(SceneKey scene, ChunkSink sink) const override LOCUS_EXCLUDES(catalogue_mutex_);

  absl::Status add_mesh(absl::string_view name, const std::array<uint8_t, 32>& sha256, ChunkSource content,
                        ChunkSource parts) override LOCUS_EXCLUDES(catalogue_mutex_, adding_mesh_);
  absl::Status delete_mesh(absl::string_view name) override LOCUS_EXCLUDES(catalogue_mutex_, adding_mesh_);
  absl::Status read_mesh(const std::array<uint8_t, 32>& sha256, ChunkSink sink) const override
      LOCUS_EXCLUDES(catalogue_mutex_);
  absl::Status read_parts(absl::string_view name, ChunkSink sink) const override LOCUS_EXCLUDES(catalogue_mutex_);
  void keep_outline(const std::array<uint8_t, 32>& sha256, absl::string_view bytes) override;
  std::optional<std::string> read_outline(const std::array<uint8_t, 32>& sha256) const override;

  absl::Status back_up(const std::string& path) override LOCUS_EXCLUDES(catalogue_mutex_);

 private:
  using SteadyTime = std::chrono::steady_clock::time_point;

  RocksdbLog(const StorageOptions& options, OpenedDirectory opened);
  // After opening: what is stored, the catalogue as it is believed from now on, no unfinished chunks.
  absl::Status begin() LOCUS_EXCLUDES(catalogue_mutex_);
  void list_stored();

  // Chunks under `prefix` of a family, whose column `pending` says in meta that they are not in use yet.
  absl::StatusOr<ChunkList> put_chunks(rocksdb::ColumnFamilyHandle* family, const std::string& pending,
                                       const std::string& prefix, ChunkSource source);
  void drop_chunks(rocksdb::ColumnFamilyHandle* family, const std::string& pending, const std::string& prefix);
  // Writes `batch` and the change with it, synced.
  absl::Status commit(const CatalogueChange& change, rocksdb::WriteBatch& batch) LOCUS_REQUIRES(catalogue_mutex_);
  absl::StatusOr<SceneRow> row_of(SceneKey scene) const LOCUS_REQUIRES(catalogue_mutex_);
  uint64_t seal_of_row(SceneKey scene) const LOCUS_REQUIRES(catalogue_mutex_);
  absl::StatusOr<uint64_t> chain_of(const SceneRow& row, uint64_t sequence) const;
  // `before` is the number of the snapshot it replaces.
  absl::Status put_snapshot(const SceneLogStatePtr& place, uint64_t before, uint64_t sequence,
                            const ContentRow& snapshot) LOCUS_EXCLUDES(catalogue_mutex_);
  // Whether the chunks of a pending key are those of a snapshot or mesh by now.
  bool in_use(absl::string_view pending) const LOCUS_REQUIRES(catalogue_mutex_);
  // Returns the row of a mesh's name, or nothing.
  std::optional<MeshRow> mesh_row(absl::string_view name) const LOCUS_REQUIRES(catalogue_mutex_);
  // Returns whether `number` is that of the parts of any name of that content.
  bool parts_in_use(absl::string_view sha256, uint64_t number) const LOCUS_REQUIRES(catalogue_mutex_);
  absl::Status read_mesh_chunks(const Sha256& sha256, const ContentRow& row, ChunkSink sink) const;
  std::set<Sha256> contents() const LOCUS_REQUIRES(catalogue_mutex_);
  bool content_in_use(const Sha256& sha256, absl::string_view but) const LOCUS_REQUIRES(catalogue_mutex_);

  absl::Status room_for(absl::string_view what, uint64_t bytes);
  void look_at_the_disk();

  // HIGH_WATER, as of now.
  void write_high_water(bool closed) LOCUS_EXCLUDES(high_water_mutex_);
  void keep() LOCUS_EXCLUDES(keeper_mutex_);
  void look_after();
  // A record was written, or written and synced.
  void wake_keeper(bool synced) LOCUS_EXCLUDES(keeper_mutex_);

  const StorageOptions options_;
  const std::unique_ptr<DirectoryLock> lock_;
  const std::unique_ptr<Database> database_;
  DamageReport damage_report_;  // until begin() is done
  std::vector<StoredScene> stored_scenes_;
  std::vector<StoredMesh> stored_meshes_;
  absl::Status catalogue_damage_;
  const bool closed_in_order_;

  TopologyFiles topologies_;
  SceneTable scenes_;
  mutable Mutex catalogue_mutex_;  // held while a change of the catalogue is written; before the two below
  Catalogue catalogue_ LOCUS_GUARDED_BY(catalogue_mutex_);
  SceneKey next_scene_ LOCUS_GUARDED_BY(catalogue_mutex_) = 1;
  Mutex adding_mesh_;  // one mesh at a time, so that content is written once; before catalogue_mutex_

  Mutex high_water_mutex_;
  std::unique_ptr<DurableMarkerFile> durable_marker_file_ LOCUS_GUARDED_BY(high_water_mutex_);
  DurableMarker durable_marker_ LOCUS_GUARDED_BY(high_water_mutex_);
  std::atomic<bool> high_water_failed_ = false;

  std::atomic<uint64_t> free_bytes_ = ~uint64_t{0};
  std::atomic<uint64_t> written_bytes_ = 0;  // since the room was looked at

  Mutex keeper_mutex_;
  ConditionVariable keeper_wakes_;
  std::optional<SteadyTime> marks_due_ LOCUS_GUARDED_BY(keeper_mutex_);
  std::optional<SteadyTime> sync_due_ LOCUS_GUARDED_BY(keeper_mutex_);
  bool ended_ LOCUS_GUARDED_BY(keeper_mutex_) = false;
  std::thread keeper_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_LOG_H_
