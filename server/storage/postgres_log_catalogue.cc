// Members of PostgresLog that change the catalogue (the rows of scenes and meshes), or write and read the chunks of
// snapshots and meshes.
#include <algorithm>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "core/scene/log/record_codec.h"
#include "server/storage/postgres_log.h"
#include "server/storage/rows/refusals.h"

namespace locus::server {
namespace {

constexpr auto kBetweenAttempts = std::chrono::milliseconds(50);
constexpr uint64_t kChunkRunBytes = uint64_t{4} << 20;  // size of chunks from which they are sent

constexpr const char* kSnapshotChunkSql =
    "INSERT INTO locus.snapshot_chunk (scene, snapshot, number, checksum, bytes)"
    " VALUES ($1::bigint, $2::bigint, $3::bigint, $4::bigint, $5::bytea)";

}  // namespace

absl::Status PostgresLog::transact(EnginePool::Use use, Change change, WasDone was_done) const {
  const Deadline deadline = change_deadline();
  absl::Status status;
  while (true) {
    ASSIGN_OR_RETURN(const EnginePool::Lease lease, acquire(use, deadline));
    // A connection that was idle may have been closed by the engine, which shows only now.
    status = lease->run("BEGIN", std::min(deadline, answer_deadline()));
    if (!status.ok() && std::chrono::steady_clock::now() + kBetweenAttempts < deadline) continue;
    if (status.ok()) status = change(*lease);
    if (!status.ok()) {
      if (!lease->in_transaction()) return status;
      lease->add("ROLLBACK");
      const absl::Status confirmed = run_barrier(*lease);
      return confirmed.ok() ? status : absl::UnavailableError(confirmed.message());
    }
    lease->add("COMMIT");
    status = run_checked(*lease, options_.replication, answer_deadline());
    if (!lease->lost()) return status;
    break;
  }
  while (std::chrono::steady_clock::now() + kBetweenAttempts < deadline) {
    std::this_thread::sleep_for(kBetweenAttempts);
    absl::StatusOr<EnginePool::Lease> lease = acquire(use, deadline);
    if (!lease.ok()) break;
    const absl::StatusOr<bool> done = was_done(**lease);
    if (!done.ok()) continue;
    return *done ? absl::OkStatus()
                 : absl::UnavailableError(absl::StrCat("the engine undid the change: ", status.message()));
  }
  return absl::UnavailableError(absl::StrCat("the engine may or may not have stored the change: ", status.message()));
}

absl::Status PostgresLog::guard(EngineConnection& connection, Led& led, bool& fenced) const {
  connection.add("SELECT token FROM locus.scene_log WHERE scene = $1::bigint FOR UPDATE",
                 SqlParameters().number(led.key));
  RETURN_IF_ERROR(connection.run(answer_deadline()));
  const EngineRows& found = connection.results()[0];
  if (found.empty()) return scene_not_stored(led.key);
  fenced = led.fenced || found.number(0, 0) != led.token;
  return fenced ? refuse_fenced(led.name) : absl::OkStatus();
}

absl::StatusOr<PostgresLog::Leader> PostgresLog::leader_of(SceneKey scene) const {
  ASSIGN_OR_RETURN(const EnginePool::Lease lease, begin_read());
  lease->add("SELECT leader, token FROM locus.scene_log WHERE scene = $1::bigint", SqlParameters().number(scene));
  lease->add("COMMIT");
  RETURN_IF_ERROR(lease->run(answer_deadline()));
  const EngineRows& found = lease->results()[0];
  if (found.empty()) return scene_not_stored(scene);
  return Leader{found.number(0, 0), found.number(0, 1)};
}

absl::StatusOr<StoredScene> PostgresLog::take_over(SceneKey scene, uint64_t token) {
  const auto take = [&](EngineConnection& connection) -> absl::Status {
    connection.add(
        "UPDATE locus.scene_log SET leader = $3::bigint, token = token + 1"
        " WHERE scene = $1::bigint AND token = $2::bigint",
        SqlParameters().number(scene).number(token).number(options_.member));
    connection.add("SELECT scene FROM locus.scene_log WHERE scene = $1::bigint", SqlParameters().number(scene));
    RETURN_IF_ERROR(connection.run(answer_deadline()));
    if (connection.results()[1].empty()) return scene_not_stored(scene);
    if (connection.results()[0].changed() == 1) return absl::OkStatus();
    return absl::AbortedError(absl::StrCat("scene ", scene, " has another leader already"));
  };
  // Also finds a takeover of an earlier call whose outcome was unknown.
  const auto taken = [&](EngineConnection& connection) -> absl::StatusOr<bool> {
    connection.add("SELECT leader, token FROM locus.scene_log WHERE scene = $1::bigint FOR UPDATE",
                   SqlParameters().number(scene));
    RETURN_IF_ERROR(run_barrier(connection));
    const EngineRows& found = connection.results()[0];
    return !found.empty() && found.number(0, 0) == options_.member && found.number(0, 1) == token + 1;
  };
  absl::Status status = transact(EnginePool::Use::kOther, take, taken);
  if (absl::IsAborted(status)) {
    ASSIGN_OR_RETURN(const EnginePool::Lease lease, acquire(EnginePool::Use::kOther, change_deadline()));
    ASSIGN_OR_RETURN(const bool was_taken, taken(*lease));
    if (was_taken) status = absl::OkStatus();
  }
  RETURN_IF_ERROR(status);
  return begin_leading(scene, options_.member, token + 1);
}

absl::StatusOr<StoredScene> PostgresLog::begin_leading(SceneKey scene, uint64_t member, uint64_t token) {
  const Retired retired = retire(scene);
  ASSIGN_OR_RETURN(const EnginePool::Lease lease, begin_read());
  lease->add(LOCUS_STORED_SCENES "WHERE s.key = $1::bigint", SqlParameters().number(scene));
  lease->add("COMMIT");
  RETURN_IF_ERROR(lease->run(change_deadline()));
  const EngineRows& found = lease->results()[0];
  if (found.empty()) return scene_not_stored(scene);
  StoredScene stored = stored_scene(found, 0);
  const absl::StatusOr<StoredSceneRow> row = scene_row(found, 0);
  if (found.number(0, kSceneColumns + 3) != member || found.number(0, kSceneColumns + 4) != token)
    return refuse_fenced(stored.name);
  const bool other_version = row.ok() && row->apply_version != options_.apply_version;
  if (other_version && stored.last_sequence > stored.snapshot_sequence)
    return refuse_apply_version(stored.name, row->apply_version, options_.apply_version);
  lead(stored, member, token, found.number(0, kSceneColumns + 2), retired.token == token ? retired.possibly_last : 0);
  // The row says of which version the records after the snapshot are, so it is changed before the first of them.
  if (other_version)
    RETURN_IF_ERROR(change_row(scene, [this](StoredSceneRow& own) { own.apply_version = options_.apply_version; }));
  return stored;
}

absl::StatusOr<ChunkList> PostgresLog::send_chunks(EngineConnection& connection, const char* sql, uint64_t owner,
                                                   uint64_t id, ChunkSource source) const {
  ChunkList list;
  uint64_t bytes = 0;
  while (true) {
    ASSIGN_OR_RETURN(std::optional<std::string> chunk, source());
    if (chunk && chunk->size() > kMaxChunkBytes) return refuse_chunk(chunk->size());
    if (chunk) {
      const uint64_t sum = chunk_checksum(id, list.chunks, *chunk);
      SqlParameters parameters;
      if (owner != 0) parameters.number(owner);
      connection.add(sql, parameters.number(id).number(list.chunks).number(sum).bytes(*chunk));
      list.add(chunk->size(), sum);
      bytes += chunk->size();
    }
    if (chunk && bytes < kChunkRunBytes) continue;
    RETURN_IF_ERROR(connection.run(change_deadline()));
    bytes = 0;
    if (!chunk) return list;
  }
}

absl::Status PostgresLog::read_chunks(EngineConnection& connection, const char* sql, const SqlParameters& parameters,
                                      uint64_t id, const ChunkList& expected, absl::string_view kind,
                                      absl::string_view name, ChunkSink sink) const {
  ChunkList list;
  RETURN_IF_ERROR(
      connection.stream(sql, parameters, options_.append_wait, [&](const EngineRows& found) -> absl::Status {
        const absl::string_view bytes = found.bytes(0, 2);
        const uint64_t sum = chunk_checksum(id, list.chunks, bytes);
        if (found.number(0, 0) != list.chunks)
          return damaged(kind, name, absl::StrCat("chunk ", list.chunks, " is missing"));
        if (found.number(0, 1) != sum)
          return damaged(kind, name, absl::StrCat("the checksum of chunk ", list.chunks, " is wrong"));
        list.add(bytes.size(), sum);
        return sink(bytes);
      }));
  return list == expected ? absl::OkStatus() : damaged(kind, name, absl::StrCat("chunk ", list.chunks, " is missing"));
}

absl::Status PostgresLog::send_row(EngineConnection& connection, const StoredSceneRow& row) const {
  connection.add(
      "UPDATE locus.scene SET spec = $2::bytea, epoch = $3::bigint, apply_version = $4::bigint, snapshot = $5::bigint,"
      " snapshot_sequence = $6::bigint, snapshot_chain = $7::bigint, chunks = $8::bigint, chunk_bytes = $9::bigint,"
      " digest = $10::bigint, checksum = $11::bigint WHERE key = $1::bigint",
      SqlParameters()
          .number(row.key)
          .bytes(row.spec)
          .number(row.epoch)
          .number(row.apply_version)
          .number(row.snapshot)
          .number(row.snapshot_sequence)
          .number(row.snapshot_chain)
          .number(row.chunks.chunks)
          .number(row.chunks.bytes)
          .number(row.chunks.digest)
          .number(checksum_of(row)));
  return connection.run(answer_deadline());
}

absl::StatusOr<SceneKey> PostgresLog::create_scene(absl::string_view name, absl::string_view spec, uint64_t epoch,
                                                   ChunkSource state) {
  StoredSceneRow row;
  row.name = std::string(name);
  row.spec = std::string(spec);
  row.epoch = epoch;
  RETURN_IF_ERROR(store_scene(row, options_.member, 1, state, {}));
  StoredScene stored;
  stored.key = row.key;
  stored.name = row.name;
  stored.epoch = epoch;
  lead(stored, options_.member, 1, row.snapshot_chain, 0);
  return row.key;
}

absl::StatusOr<SceneKey> PostgresLog::create_unled_scene(absl::string_view name, absl::string_view spec, uint64_t epoch,
                                                         ChunkSource state, absl::Span<const MeshUse> uses) {
  StoredSceneRow row;
  row.name = std::string(name);
  row.spec = std::string(spec);
  row.epoch = epoch;
  RETURN_IF_ERROR(store_scene(row, 0, 0, state, uses));
  return row.key;
}

absl::Status PostgresLog::store_scene(StoredSceneRow& row, uint64_t leader, uint64_t token, ChunkSource state,
                                      absl::Span<const MeshUse> uses) const {
  row.apply_version = options_.apply_version;
  row.snapshot = random_id();
  // Adds a row without a summary of the snapshot, which send_row() then completes. Returns its key; nullopt if the name
  // is taken. Waits for a transaction that has added the name and is not committed.
  const auto add_name = [&](EngineConnection& connection) -> absl::StatusOr<std::optional<SceneKey>> {
    connection.add(
        "INSERT INTO locus.scene (name, spec, epoch, apply_version, snapshot, snapshot_sequence, snapshot_chain, "
        "chunks,"
        " chunk_bytes, digest, checksum) VALUES ($1::text, '', 0, 0, 0, 0, 0, 0, 0, 0, 0)"
        " ON CONFLICT (name) DO NOTHING RETURNING key",
        SqlParameters().text(row.name));
    RETURN_IF_ERROR(connection.run(answer_deadline()));
    const EngineRows& found = connection.results()[0];
    return found.empty() ? std::nullopt : std::optional(found.number(0, 0));
  };
  const auto create = [&](EngineConnection& connection) -> absl::Status {
    ASSIGN_OR_RETURN(const std::optional<SceneKey> key, add_name(connection));
    if (!key) return scene_already_stored(row.name);
    row.key = *key;
    row.snapshot_chain = first_chain(row.key);
    ASSIGN_OR_RETURN(row.chunks, send_chunks(connection, kSnapshotChunkSql, row.key, row.snapshot, state));
    connection.add(
        "INSERT INTO locus.scene_log (scene, leader, token, last, chain)"
        " VALUES ($1::bigint, $2::bigint, $3::bigint, 0, $4::bigint)",
        SqlParameters().number(row.key).number(leader).number(token).number(row.snapshot_chain));
    RETURN_IF_ERROR(insert_uses(connection, row.key, uses));
    return send_row(connection, row);
  };
  const auto was_done = [&](EngineConnection& connection) -> absl::StatusOr<bool> {
    RETURN_IF_ERROR(connection.run("BEGIN", answer_deadline()));
    ASSIGN_OR_RETURN(const std::optional<SceneKey> added, add_name(connection));
    if (added) {  // the name was free, so the scene had not been stored
      connection.add("ROLLBACK");
      RETURN_IF_ERROR(run_barrier(connection));
      return false;
    }
    connection.add("SELECT key FROM locus.scene WHERE key = $1::bigint", SqlParameters().number(row.key));
    connection.add("COMMIT");
    RETURN_IF_ERROR(run_barrier(connection));
    return !connection.results()[0].empty();
  };
  return transact(EnginePool::Use::kOther, create, was_done);
}

absl::Status PostgresLog::delete_scene(SceneKey key) {
  ASSIGN_OR_RETURN(const LedPtr state, led(key));
  Led& scene = *state;
  const Report report(*this, scene);
  MutexLock writing(scene.writing);
  bool fenced = false;
  const auto remove = [&](EngineConnection& connection) LOCUS_REQUIRES(scene.writing) -> absl::Status {
    RETURN_IF_ERROR(guard(connection, scene, fenced));
    connection.add("DELETE FROM locus.record WHERE scene = $1::bigint", SqlParameters().number(key));
    connection.add("DELETE FROM locus.snapshot_chunk WHERE scene = $1::bigint", SqlParameters().number(key));
    connection.add("DELETE FROM locus.scene WHERE key = $1::bigint", SqlParameters().number(key));
    return connection.run(change_deadline());
  };
  const auto removed = [&](EngineConnection& connection) -> absl::StatusOr<bool> {
    connection.add("SELECT key FROM locus.scene WHERE key = $1::bigint FOR UPDATE", SqlParameters().number(key));
    RETURN_IF_ERROR(run_barrier(connection));
    return connection.results()[0].empty();
  };
  absl::Status status = transact(EnginePool::Use::kUrgent, remove, removed);
  if (absl::IsAborted(status) && fenced) set_fenced(scene);
  if (!status.ok() && !absl::IsNotFound(status)) return status;
  MutexLock lock(mutex_);
  led_.erase(key);
  return status;
}

absl::Status PostgresLog::change_row(SceneKey key, absl::FunctionRef<void(StoredSceneRow&)> change) {
  ASSIGN_OR_RETURN(const LedPtr state, led(key));
  Led& scene = *state;
  const Report report(*this, scene);
  MutexLock writing(scene.writing);
  StoredSceneRow row;
  bool fenced = false;
  const auto update = [&](EngineConnection& connection) LOCUS_REQUIRES(scene.writing) -> absl::Status {
    RETURN_IF_ERROR(guard(connection, scene, fenced));
    connection.add("SELECT " LOCUS_SCENE_COLUMNS " FROM locus.scene s WHERE s.key = $1::bigint FOR UPDATE",
                   SqlParameters().number(key));
    RETURN_IF_ERROR(connection.run(answer_deadline()));
    ASSIGN_OR_RETURN(row, scene_row(connection.results()[0], 0));
    change(row);
    return send_row(connection, row);
  };
  const auto was_done = [&](EngineConnection& connection) -> absl::StatusOr<bool> {
    connection.add("SELECT checksum FROM locus.scene WHERE key = $1::bigint FOR UPDATE", SqlParameters().number(key));
    RETURN_IF_ERROR(run_barrier(connection));
    const EngineRows& found = connection.results()[0];
    return !found.empty() && found.number(0, 0) == checksum_of(row);
  };
  const absl::Status status = transact(EnginePool::Use::kUrgent, update, was_done);
  if (absl::IsAborted(status) && fenced) set_fenced(scene);
  RETURN_IF_ERROR(status);
  scene.epoch = row.epoch;
  return absl::OkStatus();
}

absl::Status PostgresLog::restart_scene(SceneKey key, uint64_t epoch) {
  return change_row(key, [epoch](StoredSceneRow& row) { row.epoch = epoch; });
}

absl::Status PostgresLog::set_scene_spec(SceneKey key, absl::string_view spec) {
  return change_row(key, [spec](StoredSceneRow& row) { row.spec = std::string(spec); });
}

absl::Status PostgresLog::write_snapshot(SceneKey key, uint64_t sequence, ChunkSource state) {
  ASSIGN_OR_RETURN(const LedPtr led_scene, led(key));
  Led& scene = *led_scene;
  const uint64_t id = random_id();
  bool fenced = false;
  const auto write = [&](EngineConnection& connection) -> absl::Status {
    connection.add("SELECT " LOCUS_SCENE_COLUMNS " FROM locus.scene s WHERE s.key = $1::bigint",
                   SqlParameters().number(key));
    RETURN_IF_ERROR(connection.run(answer_deadline()));
    if (connection.results()[0].empty()) return scene_not_stored(key);
    ASSIGN_OR_RETURN(const StoredSceneRow before, scene_row(connection.results()[0], 0));
    if (sequence < before.snapshot_sequence || sequence > scene.known_last)
      return refuse_snapshot_at(sequence, before.snapshot_sequence, scene.known_last);
    ASSIGN_OR_RETURN(const ChunkList chunks, send_chunks(connection, kSnapshotChunkSql, key, id, state));
    // Appends and other changes of the scene wait from here on. The row is read again, because they did not wait
    // before.
    MutexLock writing(scene.writing);
    RETURN_IF_ERROR(guard(connection, scene, fenced));
    connection.add("SELECT " LOCUS_SCENE_COLUMNS
                   ", r.chain FROM locus.scene s LEFT JOIN locus.record r ON r.scene = s.key"
                   " AND r.sequence = $2::bigint WHERE s.key = $1::bigint",
                   SqlParameters().number(key).number(sequence));
    RETURN_IF_ERROR(connection.run(answer_deadline()));
    const EngineRows& found = connection.results()[0];
    if (found.empty()) return scene_not_stored(key);
    ASSIGN_OR_RETURN(StoredSceneRow row, scene_row(found, 0));
    if (row.snapshot != before.snapshot)
      return absl::AbortedError(
          absl::StrCat("another snapshot of scene '", row.name, "' was written at the same time"));
    if (sequence != row.snapshot_sequence) {
      if (found.is_null(0, kSceneColumns))
        return damaged("scene", row.name, absl::StrCat("record ", sequence, " is missing"));
      row.snapshot_chain = found.number(0, kSceneColumns);
    }
    row.snapshot = id;
    row.snapshot_sequence = sequence;
    row.chunks = chunks;
    row.apply_version = options_.apply_version;
    RETURN_IF_ERROR(send_row(connection, row));
    connection.add("DELETE FROM locus.snapshot_chunk WHERE scene = $1::bigint AND snapshot = $2::bigint",
                   SqlParameters().number(key).number(before.snapshot));
    connection.add("DELETE FROM locus.record WHERE scene = $1::bigint AND sequence <= $2::bigint",
                   SqlParameters().number(key).number(sequence));
    return connection.run(change_deadline());
  };
  const auto written = [&](EngineConnection& connection) -> absl::StatusOr<bool> {
    connection.add("SELECT snapshot FROM locus.scene WHERE key = $1::bigint FOR UPDATE", SqlParameters().number(key));
    RETURN_IF_ERROR(run_barrier(connection));
    const EngineRows& found = connection.results()[0];
    return !found.empty() && found.number(0, 0) == id;
  };
  absl::Status status = transact(EnginePool::Use::kOther, write, written);
  if (absl::IsAborted(status) && fenced) {
    const Report report(*this, scene);
    MutexLock writing(scene.writing);
    set_fenced(scene);
  }
  return status;
}

absl::Status PostgresLog::read_snapshot(SceneKey key, ChunkSink sink) const {
  ASSIGN_OR_RETURN(const EnginePool::Lease lease, begin_read());
  lease->add("SELECT " LOCUS_SCENE_COLUMNS " FROM locus.scene s WHERE s.key = $1::bigint", SqlParameters().number(key));
  RETURN_IF_ERROR(lease->run(answer_deadline()));
  if (lease->results()[0].empty()) return scene_not_stored(key);
  ASSIGN_OR_RETURN(const StoredSceneRow row, scene_row(lease->results()[0], 0));
  RETURN_IF_ERROR(read_chunks(*lease,
                              "SELECT number, checksum, bytes FROM locus.snapshot_chunk"
                              " WHERE scene = $1::bigint AND snapshot = $2::bigint ORDER BY number",
                              SqlParameters().number(key).number(row.snapshot), row.snapshot, row.chunks, "scene",
                              row.name, sink));
  return lease->run("COMMIT", answer_deadline());
}

absl::Status PostgresLog::back_up(const std::string&) {
  return absl::FailedPreconditionError(
      "scenes in an engine are backed up with the engine's own programs: use pg_basebackup or pg_dump");
}

}  // namespace locus::server
