// UpdateLog on RocksDB: the durable log of one machine. README.md in this folder describes the data directory, the
// damage that is detected and the repair.
//
// Threads: any thread may call any member, as UpdateLog says. A background thread syncs records of AckLevel::kMemory,
// rewrites the durable marker (file HIGH_WATER), polls the free disk space, and resumes the database within a second
// after disk errors end.
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
  // Opens the data directory; creates it if it is missing or empty. Damaged scenes and meshes are listed among the
  // stored ones with their damage. Errors: FAILED_PRECONDITION if another process has the directory open or another
  // version of locusd wrote it, DATA_LOSS if nothing in it is readable, UNAVAILABLE or RESOURCE_EXHAUSTED for an error
  // of the disk.
  static absl::StatusOr<std::unique_ptr<RocksdbLog>> open(const StorageOptions& options);
  // Closes in order: syncs every record and writes a durable marker with `closed` set.
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
  // Finishes opening: lists the stored scenes and meshes, corrects the catalogue's row, deletes unfinished chunks, and
  // starts the background thread.
  absl::Status finish_opening() LOCUS_EXCLUDES(catalogue_mutex_);
  void list_stored();

  // Writes the chunks of `source` under `prefix` and, before them, the row `pending` in meta, which marks them as
  // unfinished until a commit() deletes it. Does not sync. After an error the chunks are deleted.
  absl::StatusOr<ChunkList> put_chunks(rocksdb::ColumnFamilyHandle* family, const std::string& pending,
                                       const std::string& prefix, ChunkSource source);
  void drop_chunks(rocksdb::ColumnFamilyHandle* family, const std::string& pending, const std::string& prefix);
  // Adds the change of the catalogue to `batch` and writes the batch, synced.
  absl::Status commit(const CatalogueChange& change, rocksdb::WriteBatch& batch) LOCUS_REQUIRES(catalogue_mutex_);
  absl::StatusOr<SceneRow> row_of(SceneKey scene) const LOCUS_REQUIRES(catalogue_mutex_);
  uint64_t row_checksum_of(SceneKey scene) const LOCUS_REQUIRES(catalogue_mutex_);
  absl::StatusOr<uint64_t> running_checksum_at(const SceneRow& row, uint64_t sequence) const;
  // Commits `snapshot` and deletes the snapshot `replaced_id` and the records up to `sequence`, which it replaces.
  // ABORTED if another snapshot was committed meanwhile.
  absl::Status put_snapshot(const SceneLogStatePtr& log_state, uint64_t replaced_id, uint64_t sequence,
                            const ContentRow& snapshot) LOCUS_EXCLUDES(catalogue_mutex_);
  // Returns whether the chunks that the row `pending` marks as unfinished belong to a committed snapshot or mesh.
  bool in_use(absl::string_view pending) const LOCUS_REQUIRES(catalogue_mutex_);
  // Returns the row of the mesh's name; nothing if there is none.
  std::optional<MeshRow> mesh_row(absl::string_view name) const LOCUS_REQUIRES(catalogue_mutex_);
  // Returns whether a mesh name whose content has the hash `sha256` has parts with the content id `number`.
  bool parts_in_use(absl::string_view sha256, uint64_t number) const LOCUS_REQUIRES(catalogue_mutex_);
  absl::Status read_mesh_chunks(const Sha256& sha256, const ContentRow& row, ChunkSink sink) const;
  std::set<Sha256> content_hashes() const LOCUS_REQUIRES(catalogue_mutex_);
  bool content_in_use(const Sha256& sha256, absl::string_view but) const LOCUS_REQUIRES(catalogue_mutex_);

  absl::Status check_free_space(absl::string_view what, uint64_t bytes);
  void poll_free_space();

  // Writes the durable marker for the current synced positions. An error sets marker_failed_, which stops appending.
  void write_durable_marker(bool closed) LOCUS_EXCLUDES(marker_mutex_);
  void run_background() LOCUS_EXCLUDES(background_mutex_);
  void poll_disk();
  // Schedules the work that follows a write: a new durable marker if it was synced, else a sync.
  void wake_background(bool synced) LOCUS_EXCLUDES(background_mutex_);

  const StorageOptions options_;
  const std::unique_ptr<DirectoryLock> lock_;
  const std::unique_ptr<Database> database_;
  DamageReport damage_report_;  // empty once finish_opening() has returned
  std::vector<StoredScene> stored_scenes_;
  std::vector<StoredMesh> stored_meshes_;
  absl::Status catalogue_damage_;
  const bool closed_in_order_;

  TopologyFiles topologies_;
  SceneTable scenes_;
  mutable Mutex catalogue_mutex_;  // held while the catalogue is changed; locked before marker_mutex_
  Catalogue catalogue_ LOCUS_GUARDED_BY(catalogue_mutex_);
  SceneKey next_scene_ LOCUS_GUARDED_BY(catalogue_mutex_) = 1;
  Mutex adding_mesh_;  // serializes changes of meshes, so that content is written once; locked before catalogue_mutex_

  Mutex marker_mutex_;
  std::unique_ptr<DurableMarkerFile> durable_marker_file_ LOCUS_GUARDED_BY(marker_mutex_);
  DurableMarker durable_marker_ LOCUS_GUARDED_BY(marker_mutex_);
  std::atomic<bool> marker_failed_ = false;

  std::atomic<uint64_t> free_bytes_ = ~uint64_t{0};
  std::atomic<uint64_t> written_bytes_ = 0;  // bytes written since free_bytes_ was read

  Mutex background_mutex_;
  ConditionVariable background_wakeup_;
  std::optional<SteadyTime> marker_due_ LOCUS_GUARDED_BY(background_mutex_);
  std::optional<SteadyTime> sync_due_ LOCUS_GUARDED_BY(background_mutex_);
  bool ended_ LOCUS_GUARDED_BY(background_mutex_) = false;
  std::thread background_thread_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_LOG_H_
