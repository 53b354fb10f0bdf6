// UpdateLog on a replicated PostgreSQL, which several daemons share. A scene has one leader at a time, which alone may
// append; its token counts the leaders, and each append names the token, so that a former leader is refused (fenced)
// from the moment another one has taken over. README.md in this folder describes failures, postgres/FORMAT.md the
// tables.
//
// An acknowledged append is synced by the engine's quorum, whatever its AckLevel. If the connection is lost during an
// append, nothing is reported until another connection has found out whether it was written, for about `append_wait`;
// after that the append fails as UNAVAILABLE, and the scene's next append removes it if it was written after all.
//
// In addition to the errors of UpdateLog, members that change a scene return ABORTED if another daemon leads the scene.
//
// Threads: any thread may call any member, but append() for a scene only from one thread at a time. There is no thread
// of its own. Members wait for the engine: a few times `append_wait` at most if it is away, and longer only while a
// snapshot or mesh is sent and the engine makes progress. At most six connections are open.
#ifndef LOCUS_SERVER_STORAGE_POSTGRES_LOG_H_
#define LOCUS_SERVER_STORAGE_POSTGRES_LOG_H_

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/base/mutex.h"
#include "core/scene/log/record_codec.h"
#include "core/scene/log/update_log.h"
#include "server/storage/postgres/append_queue.h"
#include "server/storage/postgres/engine_pool.h"
#include "server/storage/postgres/rows.h"
#include "server/storage/postgres/tables.h"

namespace locus::server {

// A scene as the catalogue of the cluster has it.
struct CatalogueScene {
  SceneKey key = 0;
  std::string name;
  std::string spec;
  uint64_t epoch = 0;
  uint64_t member = 0;  // leader; 0: none
  uint64_t token = 0;
  uint64_t last_sequence = 0;
  absl::Status damage;  // not OK (DATA_LOSS): the scene must not be served
};

// Instances of one mesh that a scene places.
struct MeshUse {
  std::string name;
  std::array<uint8_t, 32> sha256 = {};
  uint64_t instances = 0;
};

struct PostgresOptions {
  std::string url;      // see EngineAddress::parse()
  uint64_t member = 0;  // id by which this daemon leads scenes, see MemberId; 0 = a random one
  EngineReplication replication = EngineReplication::kStandbys;

  std::chrono::milliseconds connect_wait{2'000};  // longest wait for one host to accept a connection
  std::chrono::milliseconds answer_wait{3'000};   // longest wait for an answer before another host is tried
  std::chrono::milliseconds append_wait{10'000};  // longest wait for the outcome of a change

  // False: stored_scenes() and stored_meshes() stay empty, because a cluster has more than one daemon may read.
  bool list_catalogue = true;
  uint64_t apply_version = kApplyVersion;  // version of the records that this daemon writes and replays

  // Called without locks, by the thread of the call that found it out. `on_fenced`: another daemon leads the scene
  // instead of the leadership with `token`; called once for each leadership, if a member returned ABORTED for this
  // reason. `on_token`: this daemon leads on with the token `now`, because it had to remove a lost append.
  std::function<void(SceneKey, uint64_t token)> on_fenced;
  std::function<void(SceneKey, uint64_t before, uint64_t now)> on_token;
  // Called with the time that an acknowledged append took, by its thread, before append() returns. The scene's lock is
  // held, so the function must not call the log.
  std::function<void(std::chrono::nanoseconds)> on_append;
};

class PostgresLog final : public UpdateLog {
 public:
  // Connects and creates the tables if the database has none. INVALID_ARGUMENT if the address is malformed;
  // FAILED_PRECONDITION if the engine acknowledges before a second machine has synced, or if its tables have a newer
  // format; UNAVAILABLE if no host accepts writes.
  static absl::StatusOr<std::unique_ptr<PostgresLog>> open(const PostgresOptions& options);
  PostgresLog(const PostgresLog&) = delete;
  PostgresLog& operator=(const PostgresLog&) = delete;

  // Leader of a scene, as the engine has it.
  struct Leader {
    uint64_t member = 0;
    uint64_t token = 0;
  };
  absl::StatusOr<Leader> leader_of(SceneKey scene) const;
  // Makes this daemon the leader of a scene if its token is still `token`, and returns the scene as it now is. All of
  // its acknowledged records can then be read, and no other daemon can append. ABORTED if another daemon was faster. A
  // call that fails as UNAVAILABLE may be repeated with the same token.
  absl::StatusOr<StoredScene> take_over(SceneKey scene, uint64_t token) LOCUS_EXCLUDES(mutex_);
  // Begins to append as the leader that the engine already has: `member`, with the token `token`. ABORTED if leader or
  // token differ; FAILED_PRECONDITION if the scene has records after its snapshot that another version of locusd wrote.
  absl::StatusOr<StoredScene> begin_leading(SceneKey scene, uint64_t member, uint64_t token) LOCUS_EXCLUDES(mutex_);
  // Returns the token with which this daemon appends. It is higher than that of the takeover if the outcome of an
  // append was unknown and its records had to be removed.
  absl::StatusOr<uint64_t> token_of(SceneKey scene) const LOCUS_EXCLUDES(mutex_);

  // Return scenes of the cluster as they are now, also of other leaders: the one of this name; at most `limit` in order
  // of their names, after the name `after`.
  absl::StatusOr<std::optional<CatalogueScene>> find_catalogued(absl::string_view name) const;
  absl::StatusOr<std::vector<CatalogueScene>> list_catalogued(absl::string_view after, size_t limit) const;
  // Return meshes as they are now, like the functions above.
  absl::StatusOr<std::optional<StoredMesh>> find_stored_mesh(absl::string_view name) const;
  absl::StatusOr<std::vector<StoredMesh>> list_stored_meshes(absl::string_view after, size_t limit) const;

  const std::vector<StoredScene>& stored_scenes() const override { return stored_scenes_; }
  const std::vector<StoredMesh>& stored_meshes() const override { return stored_meshes_; }
  absl::Status catalogue_damage() const override { return absl::OkStatus(); }
  bool closed_in_order() const override { return true; }  // every acknowledged record is synced

  absl::StatusOr<SceneKey> create_scene(absl::string_view name, absl::string_view spec, uint64_t epoch,
                                        ChunkSource state) override LOCUS_EXCLUDES(mutex_);
  // Like create_scene(), but the scene has no leader and the token 0, and this daemon does not lead it. Claims the
  // meshes that the state uses in the same transaction; NOT_FOUND, naming the mesh, if one is not stored.
  absl::StatusOr<SceneKey> create_unled_scene(absl::string_view name, absl::string_view spec, uint64_t epoch,
                                              ChunkSource state, absl::Span<const MeshUse> uses = {});
  absl::Status delete_scene(SceneKey scene) override LOCUS_EXCLUDES(mutex_);
  absl::Status restart_scene(SceneKey scene, uint64_t epoch) override LOCUS_EXCLUDES(mutex_);
  absl::Status set_scene_spec(SceneKey scene, absl::string_view spec) override LOCUS_EXCLUDES(mutex_);

  absl::StatusOr<uint64_t> append(SceneKey scene, absl::Span<const LogEntry> entries, AckLevel level) override
      LOCUS_EXCLUDES(mutex_);
  // Reads the acknowledged records, also of a scene that this daemon does not lead.
  absl::Status read(SceneKey scene, uint64_t from, RecordSink sink) const override;
  // Like read(), but ends after the record `until`, or after the last one if that is earlier.
  absl::Status read_until(SceneKey scene, uint64_t from, uint64_t until, RecordSink sink) const;
  absl::StatusOr<uint64_t> latest(SceneKey scene) const override LOCUS_EXCLUDES(mutex_);

  absl::Status write_snapshot(SceneKey scene, uint64_t sequence, ChunkSource state) override LOCUS_EXCLUDES(mutex_);
  absl::Status read_snapshot(SceneKey scene, ChunkSink sink) const override;

  absl::Status add_mesh(absl::string_view name, const std::array<uint8_t, 32>& sha256, ChunkSource content,
                        ChunkSource parts) override LOCUS_EXCLUDES(mutex_);
  // FAILED_PRECONDITION, with the reason IN_USE, if a scene has claimed the mesh.
  absl::Status delete_mesh(absl::string_view name) override;
  absl::Status set_mesh_graces(absl::Span<const std::string> names, uint32_t grace_s) override;
  absl::Status read_mesh(const std::array<uint8_t, 32>& sha256, ChunkSink sink) const override LOCUS_EXCLUDES(mutex_);
  absl::Status read_parts(absl::string_view name, ChunkSink sink) const override;
  // Claims meshes for a scene that this daemon leads, so that nobody deletes them: call it before a change that places
  // them is appended. Adds `instances` to the number of each. NOT_FOUND, naming the mesh, if no mesh of this name and
  // content is stored; nothing is claimed then. After UNAVAILABLE the claim may have happened, which only makes the
  // numbers too large until set_mesh_uses().
  absl::Status claim_meshes(SceneKey scene, absl::Span<const MeshUse> uses) LOCUS_EXCLUDES(mutex_);
  // Replaces all claims of a scene by the exact numbers; a mesh without instances is not claimed any more. Call it
  // while no claimed change waits for its append. Errors: those of claim_meshes().
  absl::Status set_mesh_uses(SceneKey scene, absl::Span<const MeshUse> uses) LOCUS_EXCLUDES(mutex_);
  // The topologies of trees are not stored: they can be computed, and each daemon would send them all through the
  // engine.
  void store_topology(const std::array<uint8_t, 32>&, absl::string_view) override {}
  std::optional<std::string> read_topology(const std::array<uint8_t, 32>&) const override { return std::nullopt; }

  // Refuses: the engine has its own programs for backups, which copy the scenes of all daemons.
  absl::Status back_up(const std::string& path) override;

 private:
  // A scene that this daemon leads, or led.
  struct Led {
    SceneKey key = 0;
    std::string name;
    Mutex writing;  // held during a whole append or change of the scene's row
    uint64_t member LOCUS_GUARDED_BY(writing) = 0;
    uint64_t token LOCUS_GUARDED_BY(writing) = 0;
    uint64_t epoch LOCUS_GUARDED_BY(writing) = 0;
    uint64_t last LOCUS_GUARDED_BY(writing) = 0;   // sequence number of the last record
    uint64_t chain LOCUS_GUARDED_BY(writing) = 0;  // running checksum after it
    // Sequence number of the last record of a failed append whose outcome is unknown; 0 if there is none. The next
    // append removes the records up to it.
    uint64_t possibly_last LOCUS_GUARDED_BY(writing) = 0;
    bool fenced LOCUS_GUARDED_BY(writing) = false;
    bool fence_unreported LOCUS_GUARDED_BY(writing) = false;
    uint64_t reported_token LOCUS_GUARDED_BY(writing) = 0;
    absl::Status damage LOCUS_GUARDED_BY(writing);  // not OK: the scene can only be deleted
    std::atomic<uint64_t> known_last = 0;           // equals `last`, for readers that do not wait for an append
  };
  using LedPtr = std::shared_ptr<Led>;
  using Change = absl::FunctionRef<absl::Status(EngineConnection&)>;
  using WasDone = absl::FunctionRef<absl::StatusOr<bool>(EngineConnection&)>;

  // Reports a fence or another token when it goes out of scope: declare it before the lock of `led.writing`.
  class Report {
   public:
    Report(const PostgresLog& log, Led& led) : log_(log), led_(led) {}
    ~Report() { log_.report(led_); }
    Report(const Report&) = delete;
    Report& operator=(const Report&) = delete;

   private:
    const PostgresLog& log_;
    Led& led_;
  };

  PostgresLog(const PostgresOptions& options, EngineAddress address);
  absl::Status list_stored();
  // Calls options_.on_token and options_.on_fenced if there is news.
  void report(Led& led) const LOCUS_EXCLUDES(led.writing);
  static void set_fenced(Led& led) LOCUS_REQUIRES(led.writing);

  absl::StatusOr<LedPtr> led(SceneKey scene) const LOCUS_EXCLUDES(mutex_);
  // Ends an earlier leadership of this daemon: waits for an append in progress and refuses later ones, because only the
  // new state will know where the log ends. Returns what may still arrive with the earlier token.
  struct Retired {
    uint64_t token = 0;
    uint64_t possibly_last = 0;
  };
  Retired retire(SceneKey scene) LOCUS_EXCLUDES(mutex_);
  void lead(const StoredScene& scene, uint64_t member, uint64_t token, uint64_t chain, uint64_t possibly_last)
      LOCUS_EXCLUDES(mutex_);

  // Returns a connection; tries again while the engine is away, until the deadline.
  absl::StatusOr<EnginePool::Lease> acquire(EnginePool::Use use, Deadline deadline) const;
  // Returns a connection in a transaction that reads one state of all tables. Tries hosts until one has committed a
  // barrier, so that the state is not older than this call.
  absl::StatusOr<EnginePool::Lease> begin_read() const;
  // Runs one statement that reads, and a barrier, on a connection for short calls, and calls `use` with the rows. Tries
  // hosts until one has answered.
  absl::Status read_committed(const char* sql, const SqlParameters& parameters,
                              absl::FunctionRef<void(const EngineRows&)> use) const;
  // Return the deadline of one answer, and that of a change with all of its attempts. Sending `bytes` may take a second
  // for each 8 MiB in addition.
  Deadline answer_deadline(uint64_t bytes = 0) const {
    return std::chrono::steady_clock::now() + options_.answer_wait + std::chrono::milliseconds(bytes >> 13);
  }
  Deadline change_deadline(uint64_t bytes = 0) const {
    return std::chrono::steady_clock::now() + options_.append_wait + std::chrono::milliseconds(bytes >> 13);
  }

  // Runs the added statements and a barrier, and checks the engine's settings.
  absl::Status run_barrier(EngineConnection& connection) const;
  // Runs `change` in a transaction and commits it. An error of `change` is returned only after a barrier, because an
  // isolated or restarted primary may show what is not, or no longer, true. If the outcome of the commit is unknown,
  // asks `was_done` on other connections until one has answered; UNAVAILABLE if none has answered until the deadline.
  absl::Status transact(EnginePool::Use use, Change change, WasDone was_done) const;
  // Locks the row of the scene's log in the open transaction and checks that this daemon leads the scene. Otherwise
  // returns ABORTED and sets `fenced`, which holds if transact() returns ABORTED, too.
  absl::Status guard(EngineConnection& connection, Led& led, bool& fenced) const LOCUS_REQUIRES(led.writing);
  // Stores a new scene, whose key is set in `row`, and claims its meshes.
  absl::Status store_scene(StoredSceneRow& row, uint64_t leader, uint64_t token, ChunkSource state,
                           absl::Span<const MeshUse> uses) const;
  // Claims the meshes of a new scene in the open transaction.
  absl::Status insert_uses(EngineConnection& connection, SceneKey scene, absl::Span<const MeshUse> uses) const;
  absl::Status send_row(EngineConnection& connection, const StoredSceneRow& row) const;
  // Changes the row of a scene that this daemon leads.
  absl::Status change_row(SceneKey scene, absl::FunctionRef<void(StoredSceneRow&)> change) LOCUS_EXCLUDES(mutex_);
  enum class UseChange : uint8_t { kAdd, kReplace };
  absl::Status change_uses(SceneKey scene, absl::Span<const MeshUse> uses, UseChange change) LOCUS_EXCLUDES(mutex_);

  void commit_group(absl::Span<Append* const> group) const;
  // Sends the appends in one transaction and sets their outcomes. Those that stay kNotWritten may be sent again.
  absl::Status send_appends(absl::Span<Append* const> appends, Deadline deadline) const;
  // Finds out on another connection which of the appends were written. Their outcomes stay kUnknown after an error.
  absl::Status resolve(absl::Span<Append* const> appends, Deadline deadline) const;
  // Removes the records of a failed append if they were written after all, under a new token.
  absl::Status remove_possibly_written(Led& led) LOCUS_REQUIRES(led.writing);

  // Sends the chunks that `source` returns, each by `sql`, whose parameters are `owner` (if it is not 0), `id`, the
  // number of the chunk, its checksum and its bytes.
  absl::StatusOr<ChunkList> send_chunks(EngineConnection& connection, const char* sql, uint64_t owner, uint64_t id,
                                        ChunkSource source) const;
  // Reads the chunks that `sql` returns and compares them with `expected`. DATA_LOSS if they differ; `kind` and `name`
  // are those of damaged().
  absl::Status read_chunks(EngineConnection& connection, const char* sql, const SqlParameters& parameters, uint64_t id,
                           const ChunkList& expected, absl::string_view kind, absl::string_view name,
                           ChunkSink sink) const;

  const PostgresOptions options_;
  mutable EnginePool pool_;
  AppendQueue queue_;
  std::vector<StoredScene> stored_scenes_;
  std::vector<StoredMesh> stored_meshes_;

  mutable Mutex mutex_;
  std::map<SceneKey, LedPtr> led_ LOCUS_GUARDED_BY(mutex_);
  // Hashes of mesh contents that read_mesh() found damaged. The next add_mesh() of such a content stores it again.
  mutable std::set<Sha256> damaged_contents_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_POSTGRES_LOG_H_
