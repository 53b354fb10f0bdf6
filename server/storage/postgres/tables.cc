#include "server/storage/postgres/tables.h"

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace locus::server {
namespace {

// Each append changes the small row of scene_log, so half of each of its pages is left free for new versions of rows.
// Bytes are not compressed: compression would cost the leader's time, and PostgreSQL's own log would not shrink by
// much.
constexpr const char* kTables[] = {
    "CREATE SCHEMA locus",
    "CREATE TABLE locus.format (number bigint NOT NULL)",
    "CREATE TABLE locus.scene (key bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY, name text COLLATE \"C\" NOT NULL "
    "UNIQUE,"
    " spec bytea NOT NULL, epoch bigint NOT NULL, apply_version bigint NOT NULL, snapshot bigint NOT NULL,"
    " snapshot_sequence bigint NOT NULL, snapshot_chain bigint NOT NULL, chunks bigint NOT NULL,"
    " chunk_bytes bigint NOT NULL, digest bigint NOT NULL, checksum bigint NOT NULL)",
    "CREATE TABLE locus.scene_log (scene bigint PRIMARY KEY REFERENCES locus.scene ON DELETE CASCADE,"
    " leader bigint NOT NULL, token bigint NOT NULL, last bigint NOT NULL, chain bigint NOT NULL)"
    " WITH (fillfactor = 50, autovacuum_vacuum_scale_factor = 0, autovacuum_vacuum_threshold = 10000)",
    "CREATE INDEX scene_of_leader ON locus.scene_log (leader)",
    "CREATE TABLE locus.member (id bigint PRIMARY KEY, address text NOT NULL, zone text NOT NULL,"
    " version text NOT NULL, load bigint NOT NULL, beat bigint NOT NULL, dead bigint NOT NULL,"
    " assigned bigint NOT NULL, forgotten bigint NOT NULL)"
    " WITH (fillfactor = 50, autovacuum_vacuum_scale_factor = 0, autovacuum_vacuum_threshold = 1000)",
    "CREATE INDEX dead_member ON locus.member (id) WHERE dead = 1",
    "CREATE TABLE locus.record (scene bigint NOT NULL, sequence bigint NOT NULL, epoch bigint NOT NULL,"
    " writer bigint NOT NULL, batch bigint NOT NULL, chain bigint NOT NULL, bytes bytea NOT NULL,"
    " PRIMARY KEY (scene, sequence))"
    " WITH (autovacuum_vacuum_scale_factor = 0.01, autovacuum_vacuum_threshold = 10000)",
    "ALTER TABLE locus.record ALTER COLUMN bytes SET STORAGE EXTERNAL",
    "CREATE TABLE locus.snapshot_chunk (scene bigint NOT NULL, snapshot bigint NOT NULL, number bigint NOT NULL,"
    " checksum bigint NOT NULL, bytes bytea NOT NULL, PRIMARY KEY (scene, snapshot, number))"
    " WITH (autovacuum_vacuum_scale_factor = 0.01, autovacuum_vacuum_threshold = 1000)",
    "ALTER TABLE locus.snapshot_chunk ALTER COLUMN bytes SET STORAGE EXTERNAL",
    "CREATE TABLE locus.mesh_content (sha256 bytea PRIMARY KEY, content bigint NOT NULL, chunks bigint NOT NULL,"
    " chunk_bytes bigint NOT NULL, digest bigint NOT NULL)",
    "CREATE TABLE locus.mesh (name text COLLATE \"C\" PRIMARY KEY, sha256 bytea NOT NULL REFERENCES locus.mesh_content,"
    " grace_s bigint NOT NULL, content bigint NOT NULL, chunks bigint NOT NULL, chunk_bytes bigint NOT NULL,"
    " digest bigint NOT NULL, checksum bigint NOT NULL)",
    "CREATE INDEX mesh_of_content ON locus.mesh (sha256)",
    "CREATE TABLE locus.scene_mesh (scene bigint NOT NULL REFERENCES locus.scene ON DELETE CASCADE,"
    " name text COLLATE \"C\" NOT NULL REFERENCES locus.mesh, instances bigint NOT NULL, PRIMARY KEY (scene, name))",
    "CREATE INDEX scene_of_mesh ON locus.scene_mesh (name)",
    "CREATE TABLE locus.mesh_chunk (content bigint NOT NULL, number bigint NOT NULL, checksum bigint NOT NULL,"
    " bytes bytea NOT NULL, PRIMARY KEY (content, number))",
    "ALTER TABLE locus.mesh_chunk ALTER COLUMN bytes SET STORAGE EXTERNAL",
};

// The session sees the warning that a wait for the standbys was cancelled. Locks of a daemon that is gone must not
// outlive the time in which another one takes over its scenes by much.
constexpr const char* kSession[] = {
    "SELECT set_config('synchronous_commit', current_setting('synchronous_commit'), false)",
    "SET client_min_messages = warning",
    "SET idle_in_transaction_session_timeout = '10s'",
    "SET client_connection_check_interval = '1s'",
    "SET tcp_keepalives_idle = 2",
    "SET tcp_keepalives_interval = 1",
    "SET tcp_keepalives_count = 3",
    "SET tcp_user_timeout = 5000",
};

constexpr int kAttempts = 5;

absl::Status refuse_engine(absl::string_view why) { return absl::FailedPreconditionError(why); }

}  // namespace

void add_engine_settings(EngineConnection& connection) {
  connection.add(
      "SELECT current_setting('fsync'), current_setting('full_page_writes'), current_setting('synchronous_commit'),"
      " current_setting('synchronous_standby_names'), current_setting('server_encoding')");
}

absl::Status check_engine(EngineConnection& connection, EngineReplication replication, Deadline deadline) {
  add_engine_settings(connection);
  RETURN_IF_ERROR(connection.run(deadline));
  RETURN_IF_ERROR(check_engine_settings(connection.results()[0], replication));
  for (const char* const setting : kSession) connection.add(setting);
  return connection.run(deadline);
}

absl::Status run_checked(EngineConnection& connection, EngineReplication replication, Deadline deadline) {
  connection.end_transaction();  // the settings are read after the commit
  add_engine_settings(connection);
  RETURN_IF_ERROR(connection.run(deadline));
  absl::Status refusal = check_engine_settings(connection.results().back(), replication);
  if (!refusal.ok()) connection.lose(refusal.message()).IgnoreError();
  return refusal;
}

absl::Status check_engine_settings(const EngineRows& found, EngineReplication replication) {
  const absl::string_view fsync = found.bytes(0, 0), pages = found.bytes(0, 1), commit = found.bytes(0, 2),
                          standbys = found.bytes(0, 3), encoding = found.bytes(0, 4);
  if (fsync != "on")
    return refuse_engine("the engine has fsync = off: a power cut would lose acknowledged updates; set it to on");
  if (pages != "on")
    return refuse_engine("the engine has full_page_writes = off: a power cut would damage the data; set it to on");
  if (commit == "off" || (commit != "on" && commit != "remote_apply" && replication == EngineReplication::kStandbys))
    return refuse_engine(
        absl::StrCat("the engine has synchronous_commit = ", commit,
                     ": it acknowledges updates before a second machine has synced them; set it to on"));
  if (standbys.empty() && replication == EngineReplication::kStandbys)
    return refuse_engine(
        "the engine has no synchronous_standby_names: it acknowledges updates before a second machine has synced them; "
        "name the standbys, or start locusd with --engine-replication storage if the engine's storage is replicated");
  if (encoding != "UTF8")
    return refuse_engine(absl::StrCat("the engine's database has the encoding ", encoding,
                                      ", which cannot store every name: create it with ENCODING 'UTF8'"));
  return absl::OkStatus();
}

absl::Status prepare_tables(EngineConnection& connection, Deadline deadline) {
  absl::Status status;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    RETURN_IF_ERROR(connection.run("SELECT (to_regclass('locus.format') IS NOT NULL)::int::bigint", deadline));
    if (connection.results()[0].number(0, 0) == 1) {
      RETURN_IF_ERROR(connection.run("SELECT number FROM locus.format", deadline));
      const EngineRows& found = connection.results()[0];
      const uint64_t format = found.empty() ? 0 : found.number(0, 0);
      if (format >= 1 && format <= kTablesFormat) return absl::OkStatus();
      return refuse_engine(absl::StrCat("the engine's tables have format ", format,
                                        ", and this version of locusd knows ", kTablesFormat,
                                        ": use a version of locusd that is at least as new as theirs"));
    }
    for (const char* const table : kTables) connection.add(table);
    connection.add("INSERT INTO locus.format VALUES ($1::bigint)", SqlParameters().number(kTablesFormat));
    status = connection.run(deadline);
    // Another daemon may create the tables at the same time: then this attempt fails, and the next one finds them.
    if (!status.ok() && !connection.usable()) return status;
  }
  return status.ok() ? absl::UnavailableError("the engine's tables were created and deleted again") : status;
}

void add_barrier(EngineConnection& connection) { connection.add("SELECT number FROM locus.format FOR KEY SHARE"); }

}  // namespace locus::server
