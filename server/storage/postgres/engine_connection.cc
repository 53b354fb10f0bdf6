#include "server/storage/postgres/engine_connection.h"

#include <libpq-fe.h>
#include <poll.h>

#include <algorithm>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/base/planted_bug.h"
#include "core/base/status_macros.h"

namespace locus::server {
namespace {

// Waits for events of a socket; returns false at the deadline.
bool wait_for(int socket, short events, Deadline deadline) {
  while (true) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now()).count();
    if (left <= 0) return false;
    pollfd waited = {socket, events, 0};
    if (poll(&waited, 1, static_cast<int>(std::min<int64_t>(left, 60'000))) > 0) return true;
  }
}

absl::string_view message_of(const char* message) {
  return absl::StripTrailingAsciiWhitespace(message == nullptr ? "" : message);
}

// Codes of errors of PostgreSQL's documentation, appendix A.
constexpr absl::string_view kReadOnly = "25006", kLockNotAvailable = "55P03";
bool has_code(const PGresult* result, absl::string_view code) {
  const char* const state = PQresultErrorField(result, PG_DIAG_SQLSTATE);
  return state != nullptr && state == code;
}

}  // namespace

void EngineRows::Clear::operator()(pg_result* result) const { PQclear(result); }

void EngineConnection::Close::operator()(pg_conn* connection) const { PQfinish(connection); }

size_t EngineRows::size() const { return static_cast<size_t>(PQntuples(result_.get())); }

absl::string_view EngineRows::bytes(size_t row, int column) const {
  const int at = static_cast<int>(row);
  return {PQgetvalue(result_.get(), at, column), static_cast<size_t>(PQgetlength(result_.get(), at, column))};
}

bool EngineRows::is_null(size_t row, int column) const {
  return PQgetisnull(result_.get(), static_cast<int>(row), column) != 0;
}

bool EngineConnection::in_transaction() const {
  const PGTransactionStatusType status = PQtransactionStatus(connection_.get());
  return !lost_ && !broken_ && (status == PQTRANS_INTRANS || status == PQTRANS_INERROR);
}

bool EngineConnection::usable() const {
  return !lost_ && !broken_ && PQtransactionStatus(connection_.get()) == PQTRANS_IDLE;
}

uint64_t EngineRows::changed() const {
  uint64_t count = 0;
  return absl::SimpleAtoi(PQcmdTuples(result_.get()), &count) ? count : 0;
}

absl::StatusOr<std::unique_ptr<EngineConnection>> EngineConnection::open(const EngineAddress& address, size_t host,
                                                                         Deadline deadline) {
  const EngineAddress::Settings settings = address.settings_of(host);
  std::vector<const char*> keywords, values;
  for (const auto& [keyword, value] : settings) {
    keywords.push_back(keyword.c_str());
    values.push_back(value.c_str());
  }
  keywords.push_back(nullptr);
  values.push_back(nullptr);
  std::unique_ptr<EngineConnection> opened(
      new EngineConnection(PQconnectStartParams(keywords.data(), values.data(), 0), host, address.host_name(host)));
  PGconn* const connection = opened->connection_.get();
  if (connection == nullptr) return absl::ResourceExhaustedError("no memory for a connection to the engine");
  PostgresPollingStatusType state = PGRES_POLLING_WRITING;
  while (PQstatus(connection) != CONNECTION_BAD && state != PGRES_POLLING_OK && state != PGRES_POLLING_FAILED) {
    if (!wait_for(PQsocket(connection), state == PGRES_POLLING_READING ? POLLIN : POLLOUT, deadline))
      return absl::UnavailableError(absl::StrCat("engine ", opened->name_, ": no answer to the attempt to connect"));
    state = PQconnectPoll(connection);
  }
  if (PQstatus(connection) != CONNECTION_OK)
    return absl::UnavailableError(absl::StrCat("engine ", opened->name_, ": ", message_of(PQerrorMessage(connection))));
  if (PQsetnonblocking(connection, 1) != 0 || PQenterPipelineMode(connection) != 1)
    return absl::UnavailableError(absl::StrCat("engine ", opened->name_, ": libpq cannot enter its pipeline mode"));
  PQsetNoticeReceiver(connection, &EngineConnection::notice, opened.get());
  return opened;
}

void EngineConnection::notice(void* connection, const PGresult* result) {
  const char* const function = PQresultErrorField(result, PG_DIAG_SOURCE_FUNCTION);
  std::string& warning = static_cast<EngineConnection*>(connection)->warning_;
  if (function != nullptr && absl::string_view(function) == "SyncRepWaitForLSN")
    warning = std::string(message_of(PQresultErrorMessage(result)));
}

absl::Status EngineConnection::prepare(const char* name, const char* sql, Deadline deadline) {
  if (PQsendPrepare(connection_.get(), name, sql, 0, nullptr) != 1) return lose(PQerrorMessage(connection_.get()));
  ++added_;
  return run(deadline);
}

void EngineConnection::add(const char* sql, const SqlParameters& parameters) {
  const int sent = PQsendQueryParams(connection_.get(), sql, parameters.count(), nullptr, parameters.values(),
                                     parameters.lengths(), parameters.formats(), 1);
  if (sent != 1 && add_error_.ok()) add_error_ = absl::UnavailableError(message_of(PQerrorMessage(connection_.get())));
  if (sent == 1) ++added_;
}

void EngineConnection::add_prepared(const char* name, const SqlParameters& parameters) {
  const int sent = PQsendQueryPrepared(connection_.get(), name, parameters.count(), parameters.values(),
                                       parameters.lengths(), parameters.formats(), 1);
  if (sent != 1 && add_error_.ok()) add_error_ = absl::UnavailableError(message_of(PQerrorMessage(connection_.get())));
  if (sent == 1) ++added_;
}

void EngineConnection::end_transaction() {
  if (PQpipelineSync(connection_.get()) == 1) {
    ++ends_;
  } else if (add_error_.ok()) {
    add_error_ = absl::UnavailableError(message_of(PQerrorMessage(connection_.get())));
  }
}

absl::Status EngineConnection::lose(absl::string_view why) {
  lost_ = true;
  return absl::UnavailableError(absl::StrCat("engine ", name_, ": ", message_of(std::string(why).c_str())));
}

absl::Status EngineConnection::wait(Deadline deadline) {
  PGconn* const connection = connection_.get();
  const int unsent = PQflush(connection);
  if (unsent < 0) return lose(PQerrorMessage(connection));
  // While data is unsent, read as well: the engine may have to send before it takes more.
  if (!wait_for(PQsocket(connection), static_cast<short>(POLLIN | (unsent == 1 ? POLLOUT : 0)), deadline))
    return lose("no answer in time");
  if (PQconsumeInput(connection) != 1) return lose(PQerrorMessage(connection));
  return absl::OkStatus();
}

absl::Status EngineConnection::send(Deadline deadline) {
  results_.clear();
  warning_.clear();
  // A statement that could not be added leaves the connection in an unknown state; nothing was synced, so nothing of
  // the statements before it is committed when the connection closes.
  if (absl::Status error = std::exchange(add_error_, absl::OkStatus()); !error.ok()) {
    broken_ = true;
    return error;
  }
  if (PQpipelineSync(connection_.get()) != 1) return lose(PQerrorMessage(connection_.get()));
  int unsent = PQflush(connection_.get());
  while (unsent == 1) {
    RETURN_IF_ERROR(wait(deadline));
    unsent = PQflush(connection_.get());
  }
  return unsent < 0 ? lose(PQerrorMessage(connection_.get())) : absl::OkStatus();
}

absl::StatusOr<PGresult*> EngineConnection::next(Deadline deadline) {
  while (PQisBusy(connection_.get()) == 1) RETURN_IF_ERROR(wait(deadline));
  return PQgetResult(connection_.get());
}

absl::Status EngineConnection::error_of(const PGresult* result) const {
  const char* const state = PQresultErrorField(result, PG_DIAG_SQLSTATE);
  const absl::string_view code = state == nullptr ? "" : state;
  const char* const primary = PQresultErrorField(result, PG_DIAG_MESSAGE_PRIMARY);
  const std::string message =
      absl::StrCat("engine ", name_, ": ", primary != nullptr ? primary : message_of(PQresultErrorMessage(result)),
                   code.empty() ? "" : " (", code, code.empty() ? "" : ")");
  // Classes of errors of PostgreSQL's documentation, appendix A.
  if (code.substr(0, 3) == "531" || code.substr(0, 3) == "532") return absl::ResourceExhaustedError(message);
  if (code.substr(0, 2) == "XX" && code != "XX000") return absl::DataLossError(message);
  return absl::UnavailableError(message);
}

absl::Status EngineConnection::run(Deadline deadline) {
  const size_t statements = std::exchange(added_, 0);
  size_t open = std::exchange(ends_, 0) + 1;  // transactions whose end was not reported yet
  blocked_.reset();
  RETURN_IF_ERROR(send(deadline));
  absl::Status failure;
  bool read_only = false;
  std::vector<EngineRows> results;
  size_t ended = 0;
  while (true) {
    ASSIGN_OR_RETURN(PGresult* const result, next(deadline));
    if (result == nullptr) {
      if (PQstatus(connection_.get()) != CONNECTION_OK) return lose(PQerrorMessage(connection_.get()));
      if (++ended > statements) return lose("results without a statement");
      continue;
    }
    EngineRows rows(result);
    const ExecStatusType status = PQresultStatus(result);
    if (status == PGRES_PIPELINE_SYNC) {
      if (--open == 0) break;
      continue;
    }
    if (status == PGRES_COMMAND_OK || status == PGRES_TUPLES_OK) {
      results.push_back(std::move(rows));
    } else if (status != PGRES_PIPELINE_ABORTED && failure.ok()) {
      failure = error_of(result);
      read_only = has_code(result, kReadOnly);
      if (has_code(result, kLockNotAvailable)) blocked_ = results.size();
    }
  }
  if (PQstatus(connection_.get()) != CONNECTION_OK) return lose(PQerrorMessage(connection_.get()));
  if (read_only) return lose(failure.message());  // this host is a standby now: another one accepts writes
  RETURN_IF_ERROR(failure);
  // The engine warns when it ends its wait for the standbys early. It then reports the commit as if they had it.
  if (!warning_.empty() && !planted(PlantedBug::kWarningIgnored)) return lose(warning_);
  results_ = std::move(results);
  return absl::OkStatus();
}

absl::Status EngineConnection::stream(const char* sql, const SqlParameters& parameters,
                                      std::chrono::milliseconds patience,
                                      absl::FunctionRef<absl::Status(const EngineRows&)> sink) {
  const auto soon = [patience] { return std::chrono::steady_clock::now() + patience; };
  add(sql, parameters);
  added_ = 0;
  RETURN_IF_ERROR(send(soon()));
  if (PQsetSingleRowMode(connection_.get()) != 1) return lose("libpq cannot enter its single-row mode");
  absl::Status failure;
  while (true) {
    ASSIGN_OR_RETURN(PGresult* const result, next(soon()));
    if (result == nullptr) {
      if (PQstatus(connection_.get()) != CONNECTION_OK) return lose(PQerrorMessage(connection_.get()));
      continue;
    }
    const EngineRows rows(result);
    const ExecStatusType status = PQresultStatus(result);
    if (status == PGRES_PIPELINE_SYNC) return failure;
    if (status == PGRES_FATAL_ERROR && failure.ok()) failure = error_of(result);
    if (status != PGRES_SINGLE_TUPLE) continue;
    if (absl::Status refused = sink(rows); !refused.ok()) {
      broken_ = true;  // the remaining rows are not read
      return refused;
    }
  }
}

}  // namespace locus::server
