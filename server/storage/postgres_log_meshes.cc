// Members of PostgresLog that store and read meshes.
#include <algorithm>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/storage/postgres_log.h"
#include "server/storage/rows/refusals.h"

namespace locus::server {
namespace {

constexpr const char* kMeshChunkSql =
    "INSERT INTO locus.mesh_chunk (content, number, checksum, bytes)"
    " VALUES ($1::bigint, $2::bigint, $3::bigint, $4::bytea)";
constexpr const char* kReadMeshChunksSql =
    "SELECT number, checksum, bytes FROM locus.mesh_chunk WHERE content = $1::bigint ORDER BY number";

std::string mesh_name_of(const Sha256& sha256) {
  return absl::StrCat("of content ", absl::BytesToHexString(view_of(sha256)).substr(0, 12), "...");
}

}  // namespace

absl::Status PostgresLog::add_mesh(absl::string_view name, const Sha256& sha256, ChunkSource content,
                                   ChunkSource parts) {
  bool was_damaged = false;
  {
    MutexLock lock(mutex_);
    was_damaged = damaged_contents_.contains(sha256);
  }
  StoredMeshRow row;
  row.name = std::string(name);
  row.sha256 = sha256;
  row.content = random_id();
  // Returns the mesh of this name, and locks its row until the end of the transaction.
  const auto find_name = [&](EngineConnection& connection) -> absl::StatusOr<std::optional<StoredMeshRow>> {
    connection.add("SELECT " LOCUS_MESH_COLUMNS " FROM locus.mesh m WHERE m.name = $1::text FOR UPDATE",
                   SqlParameters().text(name));
    RETURN_IF_ERROR(connection.run(answer_deadline()));
    if (connection.results()[0].empty()) return std::nullopt;
    ASSIGN_OR_RETURN(StoredMeshRow found, mesh_row(connection.results()[0], 0));
    return found;
  };
  // Locks the content's row, so that equal content is sent by one daemon only and is not deleted meanwhile. Returns the
  // id of the content's chunks, 0 if they are not stored yet.
  const auto lock_content = [&](EngineConnection& connection) -> absl::StatusOr<uint64_t> {
    connection.add(
        "INSERT INTO locus.mesh_content (sha256, content, chunks, chunk_bytes, digest) VALUES ($1::bytea, 0, 0, 0, 0)"
        " ON CONFLICT (sha256) DO UPDATE SET sha256 = EXCLUDED.sha256 RETURNING content",
        SqlParameters().bytes(view_of(sha256)));
    RETURN_IF_ERROR(connection.run(change_deadline()));
    return connection.results()[0].number(0, 0);
  };
  bool stored_before = false;
  const auto add = [&](EngineConnection& connection) -> absl::Status {
    ASSIGN_OR_RETURN(const std::optional<StoredMeshRow> there, find_name(connection));
    if (there && there->sha256 != sha256) return mesh_already_stored(name);
    stored_before = there.has_value();
    if (stored_before) return absl::OkStatus();
    ASSIGN_OR_RETURN(const uint64_t stored, lock_content(connection));
    if (stored == 0 || was_damaged) {
      const uint64_t id = random_id();
      ASSIGN_OR_RETURN(const ChunkList list, send_chunks(connection, kMeshChunkSql, 0, id, content));
      connection.add("DELETE FROM locus.mesh_chunk WHERE content = $1::bigint", SqlParameters().number(stored));
      connection.add(
          "UPDATE locus.mesh_content SET content = $2::bigint, chunks = $3::bigint, chunk_bytes = $4::bigint,"
          " digest = $5::bigint WHERE sha256 = $1::bytea",
          SqlParameters().bytes(view_of(sha256)).number(id).number(list.chunks).number(list.bytes).number(list.digest));
    }
    ASSIGN_OR_RETURN(row.chunks, send_chunks(connection, kMeshChunkSql, 0, row.content, parts));
    connection.add(
        "INSERT INTO locus.mesh (name, sha256, grace_s, content, chunks, chunk_bytes, digest, checksum) VALUES"
        " ($1::text, $2::bytea, 0, $3::bigint, $4::bigint, $5::bigint, $6::bigint, $7::bigint)"
        " ON CONFLICT (name) DO NOTHING",
        SqlParameters()
            .text(name)
            .bytes(view_of(sha256))
            .number(row.content)
            .number(row.chunks.chunks)
            .number(row.chunks.bytes)
            .number(row.chunks.digest)
            .number(checksum_of(row)));
    RETURN_IF_ERROR(connection.run(answer_deadline()));
    return connection.results().back().changed() == 1
               ? absl::OkStatus()
               : absl::UnavailableError(absl::StrCat("mesh '", name, "' was added by another daemon at the same time"));
  };
  // Waits for a transaction that adds this content and is not committed, by taking the lock of the content's row.
  const auto was_done = [&](EngineConnection& connection) -> absl::StatusOr<bool> {
    RETURN_IF_ERROR(connection.run("BEGIN", answer_deadline()));
    RETURN_IF_ERROR(lock_content(connection).status());
    ASSIGN_OR_RETURN(const std::optional<StoredMeshRow> found, find_name(connection));
    connection.add("ROLLBACK");
    RETURN_IF_ERROR(run_barrier(connection));
    return found && found->sha256 == sha256;
  };
  RETURN_IF_ERROR(transact(EnginePool::Use::kOther, add, was_done));
  if (was_damaged && !stored_before) {
    MutexLock lock(mutex_);
    damaged_contents_.erase(sha256);
  }
  return absl::OkStatus();
}

absl::Status PostgresLog::delete_mesh(absl::string_view name) {
  const auto remove = [&](EngineConnection& connection) -> absl::Status {
    // Locks the content's row, so that no other daemon adds a name of this content meanwhile.
    connection.add(
        "SELECT c.sha256, c.content, m.content FROM locus.mesh m JOIN locus.mesh_content c ON c.sha256 = m.sha256"
        " WHERE m.name = $1::text FOR UPDATE",
        SqlParameters().text(name));
    RETURN_IF_ERROR(connection.run(answer_deadline()));
    const EngineRows& found = connection.results()[0];
    if (found.empty()) return mesh_not_stored(name);
    const std::string sha256(found.bytes(0, 0));
    const uint64_t content = found.number(0, 1), parts = found.number(0, 2);
    // A claim that is not committed yet waits for the lock, or this transaction has waited for it.
    connection.add("SELECT count(*), coalesce(sum(instances), 0)::bigint FROM locus.scene_mesh WHERE name = $1::text",
                   SqlParameters().text(name));
    RETURN_IF_ERROR(connection.run(answer_deadline()));
    const EngineRows& uses = connection.results()[0];
    if (uses.number(0, 0) > 0) return refuse_mesh_in_use(name, uses.number(0, 1));
    connection.add("DELETE FROM locus.mesh WHERE name = $1::text", SqlParameters().text(name));
    connection.add("DELETE FROM locus.mesh_chunk WHERE content = $1::bigint", SqlParameters().number(parts));
    connection.add(
        "DELETE FROM locus.mesh_content WHERE sha256 = $1::bytea"
        " AND NOT EXISTS (SELECT FROM locus.mesh WHERE sha256 = $1::bytea)",
        SqlParameters().bytes(sha256));
    RETURN_IF_ERROR(connection.run(answer_deadline()));
    if (connection.results()[2].changed() == 0) return absl::OkStatus();
    connection.add("DELETE FROM locus.mesh_chunk WHERE content = $1::bigint", SqlParameters().number(content));
    return connection.run(change_deadline());
  };
  return transact(EnginePool::Use::kOther, remove, [&](EngineConnection& connection) -> absl::StatusOr<bool> {
    connection.add("SELECT name FROM locus.mesh WHERE name = $1::text FOR UPDATE", SqlParameters().text(name));
    RETURN_IF_ERROR(run_barrier(connection));
    return connection.results()[0].empty();
  });
}

absl::Status PostgresLog::set_mesh_graces(absl::Span<const std::string> unordered, uint32_t grace_s) {
  // The names are locked in one order, so that two daemons that set equal names do not wait for each other.
  std::vector<std::string> names(unordered.begin(), unordered.end());
  std::sort(names.begin(), names.end());
  const auto set = [&](EngineConnection& connection) -> absl::Status {
    for (const std::string& name : names) {
      connection.add("SELECT " LOCUS_MESH_COLUMNS " FROM locus.mesh m WHERE m.name = $1::text FOR UPDATE",
                     SqlParameters().text(name));
      RETURN_IF_ERROR(connection.run(answer_deadline()));
      if (connection.results()[0].empty()) return mesh_not_stored(name);
      ASSIGN_OR_RETURN(StoredMeshRow row, mesh_row(connection.results()[0], 0));
      row.grace_s = grace_s;
      connection.add("UPDATE locus.mesh SET grace_s = $2::bigint, checksum = $3::bigint WHERE name = $1::text",
                     SqlParameters().text(name).number(grace_s).number(checksum_of(row)));
      RETURN_IF_ERROR(connection.run(answer_deadline()));
    }
    return absl::OkStatus();
  };
  return transact(EnginePool::Use::kOther, set, [&](EngineConnection& connection) -> absl::StatusOr<bool> {
    bool all = true;
    for (const std::string& name : names) {
      connection.add("SELECT grace_s FROM locus.mesh WHERE name = $1::text FOR UPDATE", SqlParameters().text(name));
      RETURN_IF_ERROR(run_barrier(connection));
      const EngineRows& found = connection.results()[0];
      all = all && !found.empty() && found.number(0, 0) == grace_s;
    }
    return all;
  });
}

absl::Status PostgresLog::read_mesh(const Sha256& sha256, ChunkSink sink) const {
  ASSIGN_OR_RETURN(const EnginePool::Lease lease, begin_read());
  lease->add("SELECT content, chunks, chunk_bytes, digest FROM locus.mesh_content WHERE sha256 = $1::bytea",
             SqlParameters().bytes(view_of(sha256)));
  RETURN_IF_ERROR(lease->run(answer_deadline()));
  const EngineRows& found = lease->results()[0];
  if (found.empty()) return not_stored("the log has no mesh of this content");
  const uint64_t content = found.number(0, 0);
  const ChunkList list = {found.number(0, 1), found.number(0, 2), found.number(0, 3)};
  absl::Status status = read_chunks(*lease, kReadMeshChunksSql, SqlParameters().number(content), content, list, "mesh",
                                    mesh_name_of(sha256), sink);
  if (status.ok()) return lease->run("COMMIT", answer_deadline());
  if (absl::IsDataLoss(status)) {
    MutexLock lock(mutex_);
    damaged_contents_.insert(sha256);
  }
  return status;
}

absl::Status PostgresLog::read_parts(absl::string_view name, ChunkSink sink) const {
  ASSIGN_OR_RETURN(const EnginePool::Lease lease, begin_read());
  lease->add("SELECT " LOCUS_MESH_COLUMNS " FROM locus.mesh m WHERE m.name = $1::text", SqlParameters().text(name));
  RETURN_IF_ERROR(lease->run(answer_deadline()));
  if (lease->results()[0].empty()) return mesh_not_stored(name);
  ASSIGN_OR_RETURN(const StoredMeshRow row, mesh_row(lease->results()[0], 0));
  RETURN_IF_ERROR(read_chunks(*lease, kReadMeshChunksSql, SqlParameters().number(row.content), row.content, row.chunks,
                              "mesh", name, sink));
  return lease->run("COMMIT", answer_deadline());
}

}  // namespace locus::server
