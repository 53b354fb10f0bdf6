// One connection to the engine. Statements are sent in a pipeline, so that a transaction of several statements costs
// one round trip, and every wait has a deadline, because a hung or isolated PostgreSQL accepts statements and never
// answers. The pipeline and the single-row mode are described in PostgreSQL 15's documentation, chapter "libpq - C
// Library".
//
// If run() fails, `lost()` says what is known: if it is false, the engine refused the transaction and nothing was
// written; if it is true, the engine may or may not have committed it, now or later. A statement is never cancelled:
// PostgreSQL would end its wait for the standbys and report the commit as if they had it.
//
// Threads: one thread at a time.
#ifndef LOCUS_SERVER_STORAGE_POSTGRES_ENGINE_CONNECTION_H_
#define LOCUS_SERVER_STORAGE_POSTGRES_ENGINE_CONNECTION_H_

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/storage/postgres/engine_address.h"
#include "server/storage/postgres/sql_parameters.h"

// Declared by libpq-fe.h, which only the source file includes, so that includers of this header do not need libpq.
struct pg_conn;
struct pg_result;

namespace locus::server {

using Deadline = std::chrono::steady_clock::time_point;

// EngineRows that a statement returned. All columns are bigint, text or bytea, in binary format.
class EngineRows {
 public:
  explicit EngineRows(pg_result* result) : result_(result) {}

  size_t size() const;
  bool empty() const { return size() == 0; }
  uint64_t number(size_t row, int column) const { return RowReader(bytes(row, column)).big_u64(); }
  // Returns a text or bytes; they are valid as long as this object.
  absl::string_view bytes(size_t row, int column) const;
  bool is_null(size_t row, int column) const;
  // Returns the number of rows that the statement inserted, updated or deleted.
  uint64_t changed() const;

 private:
  struct Clear {
    void operator()(pg_result* result) const;
  };

  std::unique_ptr<pg_result, Clear> result_;
};

class EngineConnection {
 public:
  // Connects. UNAVAILABLE if the host does not answer until `deadline`, refuses the user, or does not accept writes;
  // the message names the host.
  static absl::StatusOr<std::unique_ptr<EngineConnection>> open(const EngineAddress& address, size_t host,
                                                                Deadline deadline);

  size_t host() const { return host_; }

  // Prepares a statement, which run() then sends by its name.
  absl::Status prepare(const char* name, const char* sql, Deadline deadline);

  // Add a statement to the next run(): its text, or the name of a prepared statement. `parameters` may be dropped when
  // the call returns.
  void add(const char* sql, const SqlParameters& parameters = {});
  void add_prepared(const char* name, const SqlParameters& parameters);
  // Ends the transaction of the statements that were added so far; those that are added later are another one, sent
  // with them.
  void end_transaction();
  // Sends the added statements and waits for all results. Unless BEGIN is one of them, or was one of an earlier run,
  // the statements are one transaction, committed when this call returns OK. Errors: RESOURCE_EXHAUSTED if the engine's
  // disk or memory is full, DATA_LOSS if the engine found its data damaged, UNAVAILABLE otherwise.
  absl::Status run(Deadline deadline);
  // Adds one statement to those that were added, and runs them.
  absl::Status run(const char* sql, Deadline deadline) {
    add(sql);
    return run(deadline);
  }
  // Returns the results of the last run() that succeeded, one for each statement.
  const std::vector<EngineRows>& results() const { return results_; }

  // Runs one statement and calls `sink` with each row as it arrives, so that memory is needed for one row only.
  // `patience` is the longest wait for the next row. An error of `sink` is returned, and the connection is no longer
  // usable.
  absl::Status stream(const char* sql, const SqlParameters& parameters, std::chrono::milliseconds patience,
                      absl::FunctionRef<absl::Status(const EngineRows&)> sink);

  // Returns whether the outcome of the last run() is unknown; the connection is then no longer usable.
  bool lost() const { return lost_; }
  // Returns the number of the statement at which the last run() failed because a lock was not free within the session's
  // lock_timeout, or nullopt if it did not fail for this reason. Nothing was written then.
  std::optional<size_t> blocked_statement() const { return blocked_; }
  // Makes the connection unusable, and the outcome of the last run() unknown.
  absl::Status lose(absl::string_view why);

  // Returns whether the connection may be used for another transaction. A connection with an open transaction may not:
  // when it is closed, the engine undoes the transaction.
  bool in_transaction() const;
  bool usable() const;

 private:
  struct Close {
    void operator()(pg_conn* connection) const;
  };

  EngineConnection(pg_conn* connection, size_t host, std::string name)
      : connection_(connection), host_(host), name_(std::move(name)) {}
  static void notice(void* connection, const pg_result* result);

  // Waits until the engine has sent something, or until it takes more of what is sent. Fails at `deadline`.
  absl::Status wait(Deadline deadline);
  // Sends everything that was added.
  absl::Status send(Deadline deadline);
  // Returns the next result; null at the end of the results of a statement.
  absl::StatusOr<pg_result*> next(Deadline deadline);
  absl::Status error_of(const pg_result* result) const;

  const std::unique_ptr<pg_conn, Close> connection_;
  const size_t host_;
  const std::string name_;
  size_t added_ = 0;        // statements added since the last run()
  size_t ends_ = 0;         // ends of transactions among them
  absl::Status add_error_;  // error of the first statement that could not be added
  std::string warning_;     // warning that the wait for the standbys was cancelled during the current run()
  std::vector<EngineRows> results_;
  std::optional<size_t> blocked_;
  bool lost_ = false;
  bool broken_ = false;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_POSTGRES_ENGINE_CONNECTION_H_
