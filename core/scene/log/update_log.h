// Where scenes and meshes outlive the process: for each scene a snapshot of its state and, after that, one record for
// each revision, numbered without gaps. What bytes mean is the caller's affair (core/scene/log/record_codec.h); the log
// keeps them, finds damage and says so. Implemented in server/storage, handed to scenes by the daemon's main.
//
// Beyond one machine the same interface is to be served by a replicated log: numbers are dense within a scene, every
// record carries the epoch of the writer that wrote it and the batch it came from, and how much an ack promises is an
// AckLevel.
//
// Threads: every member may be called from any thread; of one scene, append() by one thread at a time. Calls wait for
// the disk. Errors of all: RESOURCE_EXHAUSTED where the disk is full (queries need no disk: keep serving them, try
// again later), DATA_LOSS naming what is damaged, UNAVAILABLE for a disk that fails otherwise. After an error of a call
// that writes nothing counts as written, though a part may turn up after a restart; the same call may be made again.
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

// Names a scene for ever: another scene of the same name has another key. Never 0.
using SceneKey = uint64_t;

// What has happened before append() returns.
enum class AckLevel : uint8_t {
  kMemory,  // the log has the record and brings it to the disk soon: survives the process, not the machine
  kLocal,   // the record is on this machine's disk
};

// One revision on its way into the log.
struct LogEntry {
  uint64_t epoch = 0;
  uint64_t writer = 0;  // the batch that made it, where it was numbered; of several, the last
  uint64_t batch = 0;
  absl::string_view bytes;  // at most kMaxRecordBytes
};

struct LogRecord {
  uint64_t sequence = 0;  // from 1, without gaps
  LogEntry entry;
};

// A scene as it is found when a log is opened.
struct StoredScene {
  SceneKey key = 0;
  std::string name;
  std::string spec;  // the caller's bytes
  uint64_t epoch = 0;
  uint64_t snapshot_sequence = 0;  // the snapshot holds all records up to here
  uint64_t last_sequence = 0;      // of the last record
  uint64_t log_bytes = 0;          // of the records after the snapshot
  bool copied = false;             // by back_up(), from a log that went on: restart_scene() it before it goes on here
  absl::Status damage;             // DATA_LOSS: nothing of it may be believed or served
};

struct StoredMesh {
  std::string name;
  std::array<uint8_t, 32> sha256 = {};
  absl::Status damage;            // likewise
  bool parts_in_content = false;  // written in format 1, whose content holds the parts; read_parts() has none
};

// The next piece of something long, nothing at its end, or why it cannot be had.
using ChunkSource = absl::FunctionRef<absl::StatusOr<std::optional<std::string>>()>;
using ChunkSink = absl::FunctionRef<absl::Status(absl::string_view)>;
using RecordSink = absl::FunctionRef<absl::Status(const LogRecord&)>;

class UpdateLog {
 public:
  static constexpr size_t kMaxRecordBytes = size_t{1} << 30;
  static constexpr size_t kMaxChunkBytes = size_t{1} << 20;

  virtual ~UpdateLog() = default;

  // What was there when the log was opened, by name. Changes afterwards are not shown.
  virtual const std::vector<StoredScene>& stored_scenes() const = 0;
  virtual const std::vector<StoredMesh>& stored_meshes() const = 0;
  // DATA_LOSS where scenes or meshes may be missing from these lists, or stand in them though they were deleted.
  virtual absl::Status catalogue_damage() const = 0;
  // Whether the process before came to its end in order, so that records of AckLevel::kMemory are all here.
  virtual bool closed_in_order() const = 0;

  // A new scene whose state is the snapshot `state` makes (chunks of at most kMaxChunkBytes), at sequence 0. On the
  // disk when this returns, as after all calls but append().
  virtual absl::StatusOr<SceneKey> create_scene(absl::string_view name, absl::string_view spec, uint64_t epoch,
                                                ChunkSource state) = 0;
  // Also of a damaged scene.
  virtual absl::Status delete_scene(SceneKey scene) = 0;
  // From now on the scene's records carry another epoch: something of it was lost, or goes on elsewhere.
  virtual absl::Status restart_scene(SceneKey scene, uint64_t epoch) = 0;

  // Adds records in order, all or none, with one sync where `level` asks for it; of several scenes that append at a
  // time one sync may serve all. They are of the scene's epoch, and together at most kMaxRecordBytes. Returns the
  // number of the last. FAILED_PRECONDITION for another epoch.
  virtual absl::StatusOr<uint64_t> append(SceneKey scene, absl::Span<const LogEntry> entries, AckLevel level) = 0;
  // The records from number `from` on, which come after the snapshot's, in order, until `sink` fails.
  virtual absl::Status read(SceneKey scene, uint64_t from, RecordSink sink) const = 0;
  // The number of the last record.
  virtual absl::StatusOr<uint64_t> latest(SceneKey scene) const = 0;

  // Puts `state` in the place of the snapshot and of all records up to `sequence`, which are dropped. Appending goes on
  // meanwhile. After an error the snapshot before is still there.
  virtual absl::Status write_snapshot(SceneKey scene, uint64_t sequence, ChunkSource state) = 0;
  virtual absl::Status read_snapshot(SceneKey scene, ChunkSink sink) const = 0;

  // Keeps the mesh's bytes once however many names they have: `content` is not asked for bytes that are known. Keeps
  // `parts` for each name.
  virtual absl::Status add_mesh(absl::string_view name, const std::array<uint8_t, 32>& sha256, ChunkSource content,
                                ChunkSource parts) = 0;
  virtual absl::Status delete_mesh(absl::string_view name) = 0;
  virtual absl::Status read_mesh(const std::array<uint8_t, 32>& sha256, ChunkSink sink) const = 0;
  virtual absl::Status read_parts(absl::string_view name, ChunkSink sink) const = 0;

  // Beside the mesh of this content what saves time when it is recovered (core/scene/log/tree_codec.h). A cache: bytes
  // come back as they were kept or not at all, and what cannot be kept is not. Gone with the mesh; not in a copy. Of
  // one content by one thread at a time.
  virtual void keep_outline(const std::array<uint8_t, 32>& sha256, absl::string_view bytes) = 0;
  virtual std::optional<std::string> read_outline(const std::array<uint8_t, 32>& sha256) const = 0;

  // A copy of everything as it is at one moment, in the new directory `path`, while all goes on.
  virtual absl::Status back_up(const std::string& path) = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_UPDATE_LOG_H_
