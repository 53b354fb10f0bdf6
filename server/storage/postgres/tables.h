// The tables of the log in PostgreSQL, and the checks of an engine before its first use. FORMAT.md describes each
// column. Free functions; one thread at a time for each connection.
#ifndef LOCUS_SERVER_STORAGE_POSTGRES_TABLES_H_
#define LOCUS_SERVER_STORAGE_POSTGRES_TABLES_H_

#include "absl/status/status.h"
#include "server/storage/postgres/engine_connection.h"

namespace locus::server {

inline constexpr uint64_t kTablesFormat = 1;

// Component that guarantees that an acknowledged commit survives the loss of a machine.
enum class EngineReplication : uint8_t {
  kStandbys,  // PostgreSQL waits for a synchronous standby
  kStorage,   // the storage below PostgreSQL is replicated, so PostgreSQL needs no standby
};

// Adds a statement that returns the settings of the engine on which the promises depend.
void add_engine_settings(EngineConnection& connection);
// Checks the result of this statement. FAILED_PRECONDITION, with the setting to change, if a commit might be
// acknowledged before a second machine has synced it, if a crash might damage the data, or if the database cannot store
// every name.
absl::Status check_engine_settings(const EngineRows& settings, EngineReplication replication);

// Runs and checks the statement, then fixes the settings of the session: it keeps synchronous_commit as it is now, and
// the engine ends its transactions soon after this daemon has died or its machine cannot be reached.
absl::Status check_engine(EngineConnection& connection, EngineReplication replication, Deadline deadline);

// Runs the added statements and checks the engine's settings again: an operator may change them at any time, which the
// engine does not report. If they are refused, the connection is lost: the commit may have had no second machine.
absl::Status run_checked(EngineConnection& connection, EngineReplication replication, Deadline deadline);

// Creates the tables if the database has none. FAILED_PRECONDITION if their format is newer than kTablesFormat.
absl::Status prepare_tables(EngineConnection& connection, Deadline deadline);

// Adds a statement that makes the commit of its transaction wait for the standbys, as the commit of a change does, by a
// shared lock of a row. A transaction that only reads does not wait: after a restart of PostgreSQL it may see commits
// that no standby has, and an isolated old primary answers it, too.
void add_barrier(EngineConnection& connection);

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_POSTGRES_TABLES_H_
