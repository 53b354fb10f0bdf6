// Interface of the durable storage of scenes and meshes. A scene is stored as a snapshot of its state and the later
// records, which have consecutive sequence numbers. The log stores bytes, which the caller encodes
// (core/scene/log/record_codec.h), and detects damage of the stored bytes. Implemented in server/storage; the daemon's
// main() passes it to the scenes.
//
// A log of a cluster implements this interface, too: server/storage/postgres_log.h. Its members that change a scene
// have one more error, ABORTED: another daemon leads the scene now (this one is fenced), and the caller must stop
// leading it. For such a log every record has the epoch of the scene and the writer id and number of its batch, and the
// durability of an ack is an AckLevel.
//
// Threads: every member may be called from any thread, but append() for a scene only from one thread at a time. Calls
// wait for the disk. Errors of all members: RESOURCE_EXHAUSTED if the disk is full, DATA_LOSS naming the damaged item,
// and UNAVAILABLE if the disk fails in another way. If the disk is full, the caller should continue to serve queries,
// which need no disk, and try again later. If a call that writes fails, treat its data as not written, although a part
// of the data may be found after a restart. The caller may repeat the call.
#ifndef LOCUS_CORE_SCENE_LOG_UPDATE_LOG_H_
#define LOCUS_CORE_SCENE_LOG_UPDATE_LOG_H_

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"

namespace locus {

// Unique key of a scene, never used again: a later scene of the same name has another key. Never 0.
using SceneKey = uint64_t;

// Durability that append() waits for.
enum class AckLevel : uint8_t {
  kMemory,  // the log has accepted the record and syncs it soon: survives a crash of the process, not of the machine
  kLocal,   // the record is synced to this machine's disk
};

// Record to be appended.
struct LogEntry {
  uint64_t epoch = 0;
  uint64_t writer = 0;      // writer id of the batch, or of the last joined batch; 0: no writer id
  uint64_t batch = 0;       // number of the same batch in the sequence of its writer; 0: no number
  absl::string_view bytes;  // at most kMaxRecordBytes
};

struct LogRecord {
  uint64_t sequence = 0;  // position in the scene's log, from 1 without gaps
  LogEntry entry;
};

// Scene that was found when the log was opened.
struct StoredScene {
  SceneKey key = 0;
  std::string name;
  std::string spec;  // the scene's SceneSpec, encoded by encode_spec() (core/scene/spec_codec.h)
  uint64_t epoch = 0;
  uint64_t snapshot_sequence = 0;  // sequence number of the last record whose effect is in the snapshot
  uint64_t last_sequence = 0;      // sequence number of the last record
  uint64_t log_bytes = 0;          // size in bytes of the records after the snapshot
  bool copied = false;  // true: this is a copy made by back_up(); call restart_scene() before the first append()
  absl::Status damage;  // not OK (DATA_LOSS): the scene must not be served
};

struct StoredMesh {
  std::string name;
  std::array<uint8_t, 32> sha256 = {};  // hash of the content
  absl::Status damage;                  // not OK (DATA_LOSS): the mesh must not be used
  uint32_t grace_s = 0;                 // last value of set_mesh_graces(), or 0
  bool parts_in_content = false;  // true (data format 1): the content includes the parts; read_parts() returns none
};

// Function that returns the next chunk of a long sequence of bytes, nullopt at its end, or an error.
using ChunkSource = absl::FunctionRef<absl::StatusOr<std::optional<std::string>>()>;
using ChunkSink = absl::FunctionRef<absl::Status(absl::string_view)>;
using RecordSink = absl::FunctionRef<absl::Status(const LogRecord&)>;

class UpdateLog {
 public:
  static constexpr size_t kMaxRecordBytes = size_t{1} << 30;
  static constexpr size_t kMaxChunkBytes = size_t{1} << 20;

  virtual ~UpdateLog() = default;

  // Return the scenes and meshes that were found when the log was opened, in name order. Later changes are not
  // included.
  virtual const std::vector<StoredScene>& stored_scenes() const = 0;
  virtual const std::vector<StoredMesh>& stored_meshes() const = 0;
  // Returns DATA_LOSS if stored_scenes() or stored_meshes() may lack entries or contain deleted scenes or meshes.
  virtual absl::Status catalogue_damage() const = 0;
  // Returns true if the previous process shut down cleanly, so that no record of AckLevel::kMemory was lost.
  virtual bool closed_in_order() const = 0;

  // Creates a scene with a snapshot at sequence number 0; `state` returns the chunks of the snapshot, of at most
  // kMaxChunkBytes each. Returns the key of the scene. When this call returns, the scene is synced to the disk. Every
  // other call that writes also syncs its data before it returns, except append() and store_topology().
  virtual absl::StatusOr<SceneKey> create_scene(absl::string_view name, absl::string_view spec, uint64_t epoch,
                                                ChunkSource state) = 0;
  // Deletes a scene, damaged or not.
  virtual absl::Status delete_scene(SceneKey scene) = 0;
  // Starts a new epoch for the records that follow. Required in two cases: acknowledged records may have been lost, or
  // the scene is a copy and its original may have appended further records.
  virtual absl::Status restart_scene(SceneKey scene, uint64_t epoch) = 0;
  // Replaces the encoded SceneSpec of a scene; its records and its snapshot stay.
  virtual absl::Status set_scene_spec(SceneKey scene, absl::string_view spec) = 0;

  // Appends records in order, all or none, with one sync if `level` requires it; one sync may serve several scenes that
  // append at the same time. Preconditions: the entries have the scene's epoch (FAILED_PRECONDITION otherwise), and
  // their bytes are at most kMaxRecordBytes in total. Returns the sequence number of the last record.
  virtual absl::StatusOr<uint64_t> append(SceneKey scene, absl::Span<const LogEntry> entries, AckLevel level) = 0;
  // Calls `sink` with each record from sequence number `from` on, in order, until `sink` returns an error.
  // Precondition: the snapshot does not include record `from`.
  virtual absl::Status read(SceneKey scene, uint64_t from, RecordSink sink) const = 0;
  // Returns the sequence number of the last record.
  virtual absl::StatusOr<uint64_t> latest(SceneKey scene) const = 0;

  // Replaces the snapshot by `state`, which includes the records up to `sequence`, and drops these records. append()
  // may be called meanwhile. After an error the previous snapshot stays in use.
  virtual absl::Status write_snapshot(SceneKey scene, uint64_t sequence, ChunkSource state) = 0;
  virtual absl::Status read_snapshot(SceneKey scene, ChunkSink sink) const = 0;

  // Adds a mesh name. The content (vertices and indices) is stored once for all names of equal content. So `content` is
  // called only if the content is not stored yet, or if read_mesh() has found the stored content damaged. The result of
  // `parts` is stored for each name.
  virtual absl::Status add_mesh(absl::string_view name, const std::array<uint8_t, 32>& sha256, ChunkSource content,
                                ChunkSource parts) = 0;
  virtual absl::Status delete_mesh(absl::string_view name) = 0;
  // Stores a number of seconds for each of the mesh names, with one write: see Registry::make_collectable(). At most
  // limits::kMaxLifetimeSeconds. Returns NOT_FOUND, and stores nothing, if one of the meshes is not stored.
  virtual absl::Status set_mesh_graces(absl::Span<const std::string> names, uint32_t grace_s) = 0;
  virtual absl::Status read_mesh(const std::array<uint8_t, 32>& sha256, ChunkSink sink) const = 0;
  virtual absl::Status read_parts(absl::string_view name, ChunkSink sink) const = 0;

  // Write and read a cache that makes recovery faster: the cache has one tree topology (core/scene/log/tree_codec.h)
  // for each content. Writing ignores errors; reading returns nullopt if nothing is stored. The topology is deleted
  // with the last name of its content and is not part of a backup. For each content, only one thread at a time may
  // call these two functions.
  virtual void store_topology(const std::array<uint8_t, 32>& sha256, absl::string_view bytes) = 0;
  virtual std::optional<std::string> read_topology(const std::array<uint8_t, 32>& sha256) const = 0;

  // Returns the memory in bytes of the log's caches and of its write buffers, which hold records that are not in a
  // table file yet.
  virtual uint64_t cache_bytes() const { return 0; }

  // Writes a consistent copy of all scenes and meshes into the new directory `path`. Other calls may continue
  // meanwhile.
  virtual absl::Status back_up(const std::string& path) = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_UPDATE_LOG_H_
