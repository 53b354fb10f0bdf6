// UpdateLog on RocksDB: stores scenes, their records and meshes in a data directory of this machine. README.md in this
// folder describes the files, the damage that is detected, and the repair.
//
// Threads: any thread may call any member, but append() for a scene only from one thread at a time. A background thread
// syncs records that were appended with AckLevel::kMemory, rewrites the durable marker (file HIGH_WATER), polls the
// free disk space, and resumes the database within a second after disk errors end.
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

#include "absl/functional/function_ref.h"
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
  // Opens the data directory; creates it if it is missing or empty. stored_scenes() and stored_meshes() also list
  // damaged scenes and meshes, with their damage. Errors: FAILED_PRECONDITION if a process has the directory open, if
  // this version of locusd does not know the directory's format, or if a repair was interrupted; DATA_LOSS if the
  // directory is too damaged to be opened; RESOURCE_EXHAUSTED if the disk is full; UNAVAILABLE for any other error of
  // the disk.
  static absl::StatusOr<std::unique_ptr<RocksdbLog>> open(const StorageOptions& options);
  // Syncs every record, then writes a durable marker. The marker's member `closed` is true if the sync succeeded.
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
  absl::Status set_scene_spec(SceneKey scene, absl::string_view spec) override LOCUS_EXCLUDES(catalogue_mutex_);

  absl::StatusOr<uint64_t> append(SceneKey scene, absl::Span<const LogEntry> entries, AckLevel level) override;
  absl::Status read(SceneKey scene, uint64_t from, RecordSink sink) const override LOCUS_EXCLUDES(catalogue_mutex_);
  absl::StatusOr<uint64_t> latest(SceneKey scene) const override;

  absl::Status write_snapshot(SceneKey scene, uint64_t sequence, ChunkSource state) override
      LOCUS_EXCLUDES(catalogue_mutex_);
  absl::Status read_snapshot(SceneKey scene, ChunkSink sink) const override LOCUS_EXCLUDES(catalogue_mutex_);

  absl::Status add_mesh(absl::string_view name, const std::array<uint8_t, 32>& sha256, ChunkSource content,
                        ChunkSource parts) override LOCUS_EXCLUDES(catalogue_mutex_, adding_mesh_);
  absl::Status delete_mesh(absl::string_view name) override LOCUS_EXCLUDES(catalogue_mutex_, adding_mesh_);
  absl::Status set_mesh_graces(absl::Span<const std::string> names, uint32_t grace_s) override
      LOCUS_EXCLUDES(catalogue_mutex_, adding_mesh_);
  absl::Status read_mesh(const std::array<uint8_t, 32>& sha256, ChunkSink sink) const override
      LOCUS_EXCLUDES(catalogue_mutex_);
  absl::Status read_parts(absl::string_view name, ChunkSink sink) const override LOCUS_EXCLUDES(catalogue_mutex_);
  void store_topology(const std::array<uint8_t, 32>& sha256, absl::string_view bytes) override;
  std::optional<std::string> read_topology(const std::array<uint8_t, 32>& sha256) const override;

  uint64_t cache_bytes() const override;
  absl::Status back_up(const std::string& path) override LOCUS_EXCLUDES(catalogue_mutex_);

 private:
  using SteadyTime = std::chrono::steady_clock::time_point;

  RocksdbLog(const StorageOptions& options, OpenedDirectory opened);
  // Finishes opening: lists the stored scenes and meshes, rewrites the row with the catalogue's generation and sums if
  // it is wrong, deletes the chunks of unfinished snapshots and meshes, and starts the background thread.
  absl::Status finish_opening() LOCUS_EXCLUDES(catalogue_mutex_);
  void list_stored();

  // Writes the chunks that `source` returns into `family`, under keys that begin with `prefix`, and returns the summary
  // of the chunks. Before the chunks, writes a row with the key `pending` into the family meta. This row marks the
  // chunks as unfinished until a commit() deletes the row. Does not sync. After an error deletes the chunks again.
  absl::StatusOr<ChunkList> put_chunks(rocksdb::ColumnFamilyHandle* family, const std::string& pending,
                                       const std::string& prefix, ChunkSource source);
  void drop_chunks(rocksdb::ColumnFamilyHandle* family, const std::string& pending, const std::string& prefix);
  // Adds the rows of `change` to `batch`, writes the batch and syncs it.
  absl::Status commit(const CatalogueChange& change, rocksdb::WriteBatch& batch) LOCUS_REQUIRES(catalogue_mutex_);
  absl::StatusOr<SceneRow> row_of(SceneKey scene) const LOCUS_REQUIRES(catalogue_mutex_);
  // Commits the row of a scene that `change` has changed.
  absl::Status change_row(SceneKey scene, absl::FunctionRef<void(SceneRow&)> change) LOCUS_EXCLUDES(catalogue_mutex_);
  uint64_t row_checksum_of(SceneKey scene) const LOCUS_REQUIRES(catalogue_mutex_);
  absl::StatusOr<uint64_t> running_checksum_at(const SceneRow& row, uint64_t sequence) const;
  // Commits `snapshot`, which includes the records up to `sequence`. Deletes these records and the scene's previous
  // snapshot, whose content id is `replaced_id`. ABORTED if another snapshot was committed meanwhile.
  absl::Status put_snapshot(const SceneLogStatePtr& log_state, uint64_t replaced_id, uint64_t sequence,
                            const ContentRow& snapshot) LOCUS_EXCLUDES(catalogue_mutex_);
  // Returns whether the chunks that the row `pending` marks as unfinished belong to a committed snapshot or mesh.
  bool in_use(absl::string_view pending) const LOCUS_REQUIRES(catalogue_mutex_);
  // Returns the row of the mesh `name`; no value if the catalogue has no intact row of this name.
  std::optional<MeshRow> mesh_row(absl::string_view name) const LOCUS_REQUIRES(catalogue_mutex_);
  // Returns whether `number` is the content id of the parts of a mesh. `sha256` (32 bytes) is the hash of the mesh's
  // content.
  bool parts_in_use(absl::string_view sha256, uint64_t number) const LOCUS_REQUIRES(catalogue_mutex_);
  absl::Status read_mesh_chunks(const Sha256& sha256, const ContentRow& row, ChunkSink sink) const;
  std::set<Sha256> content_hashes() const LOCUS_REQUIRES(catalogue_mutex_);
  bool content_in_use(const Sha256& sha256, absl::string_view but) const LOCUS_REQUIRES(catalogue_mutex_);

  absl::Status check_free_space(absl::string_view what, uint64_t bytes);
  void poll_free_space();

  // Writes the durable marker with the last synced record of each scene. `closed` is true for the last marker of a
  // clean shutdown. After an error, marker_failed_ is true and append() fails until a marker can be written.
  void write_durable_marker(bool closed) LOCUS_EXCLUDES(marker_mutex_);
  void run_background() LOCUS_EXCLUDES(background_mutex_);
  void poll_disk();
  // Schedules the background work after a write: a new durable marker if the write was synced, otherwise a sync.
  void wake_background(bool synced) LOCUS_EXCLUDES(background_mutex_);

  const StorageOptions options_;
  const std::unique_ptr<DirectoryLock> lock_;
  const std::unique_ptr<Database> database_;
  DamageReport damage_report_;  // result of verifying the directory; empty once finish_opening() has returned
  std::vector<StoredScene> stored_scenes_;
  std::vector<StoredMesh> stored_meshes_;
  absl::Status catalogue_damage_;
  const bool closed_in_order_;

  TopologyFiles topologies_;
  SceneTable scenes_;
  mutable Mutex catalogue_mutex_;  // held while the catalogue is changed; lock it before marker_mutex_
  Catalogue catalogue_ LOCUS_GUARDED_BY(catalogue_mutex_);
  SceneKey next_scene_ LOCUS_GUARDED_BY(catalogue_mutex_) = 1;
  // Hashes of mesh contents that read_mesh() found damaged. The next add_mesh() of such a content stores it again.
  mutable std::set<Sha256> damaged_contents_ LOCUS_GUARDED_BY(catalogue_mutex_);
  // Serializes add_mesh() and delete_mesh(), so that equal content is written only once. Lock it before
  // catalogue_mutex_.
  Mutex adding_mesh_;

  Mutex marker_mutex_;
  std::unique_ptr<DurableMarkerFile> durable_marker_file_ LOCUS_GUARDED_BY(marker_mutex_);
  DurableMarker durable_marker_ LOCUS_GUARDED_BY(marker_mutex_);
  std::atomic<bool> marker_failed_ = false;

  std::atomic<uint64_t> free_bytes_ = ~uint64_t{0};
  std::atomic<uint64_t> written_bytes_ = 0;  // bytes written since the last poll of free_bytes_

  Mutex background_mutex_;
  ConditionVariable background_wakeup_;
  std::optional<SteadyTime> marker_due_ LOCUS_GUARDED_BY(background_mutex_);
  std::optional<SteadyTime> sync_due_ LOCUS_GUARDED_BY(background_mutex_);
  bool ended_ LOCUS_GUARDED_BY(background_mutex_) = false;
  std::thread background_thread_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROCKSDB_LOG_H_
