#include "tests/bench/cluster/bare_client.h"

#include <vector>

#include "absl/strings/str_cat.h"
#include "server/storage/postgres/sql_parameters.h"
#include "server/storage/postgres_log.h"

namespace locus::bench::cluster {
namespace {

using server::SqlParameters;
using ResultPtr = std::unique_ptr<PGresult, decltype(&PQclear)>;

absl::StatusOr<ResultPtr> checked(PGconn* connection, PGresult* raw) {
  ResultPtr result(raw, &PQclear);
  const ExecStatusType status = PQresultStatus(raw);
  if (status == PGRES_COMMAND_OK || status == PGRES_TUPLES_OK) return result;
  return absl::UnavailableError(PQerrorMessage(connection));
}

absl::StatusOr<ResultPtr> execute(PGconn* connection, const char* sql, const SqlParameters& parameters) {
  return checked(connection, PQexecParams(connection, sql, parameters.count(), nullptr, parameters.values(),
                                          parameters.lengths(), parameters.formats(), 1));
}

}  // namespace

absl::StatusOr<BareClient> BareClient::create(const std::string& url, const std::string& scene) {
  BareClient client(PQconnectdb(url.c_str()));
  PGconn* const connection = client.connection_.get();
  if (PQstatus(connection) != CONNECTION_OK) return absl::UnavailableError(PQerrorMessage(connection));
  auto row =
      execute(connection,
              "INSERT INTO locus.scene (name, spec, epoch, apply_version, snapshot, snapshot_sequence, snapshot_chain,"
              " chunks, chunk_bytes, digest, checksum) VALUES ($1::text, '', 1, 1, 0, 0, 0, 0, 0, 0, 0) RETURNING key",
              SqlParameters().text(scene));
  if (!row.ok()) return row.status();
  client.key_ = server::RowReader({PQgetvalue(row->get(), 0, 0), 8}).big_u64();
  auto log = execute(connection,
                     "INSERT INTO locus.scene_log (scene, leader, token, last, chain) VALUES ($1::bigint, 1, 1, 0, 0)",
                     SqlParameters().number(client.key_));
  if (!log.ok()) return log.status();
  auto prepared = checked(connection, PQprepare(connection, "append", server::kAppendStatement, 0, nullptr));
  if (!prepared.ok()) return prepared.status();
  return client;
}

absl::Status BareClient::append(const std::string& record) {
  const uint64_t zero[] = {0};
  const absl::string_view bytes[] = {record};
  SqlParameters parameters;
  parameters.number(key_).number(1).number(last_).number(last_ + 1).number(0).number(1);
  parameters.numbers(zero).numbers(zero).numbers(zero).list_of_bytes(bytes);
  PGconn* const connection = connection_.get();
  auto appended = checked(connection, PQexecPrepared(connection, "append", parameters.count(), parameters.values(),
                                                     parameters.lengths(), parameters.formats(), 1));
  if (!appended.ok()) return appended.status();
  if (absl::string_view(PQcmdTuples(appended->get())) != "1") return absl::AbortedError("nothing was appended");
  ++last_;
  return absl::OkStatus();
}

absl::StatusOr<std::string> BareClient::read_all() {
  auto rows = execute(connection_.get(), "SELECT bytes FROM locus.record WHERE scene = $1::bigint ORDER BY sequence",
                      SqlParameters().number(key_));
  if (!rows.ok()) return rows.status();
  std::string all;
  for (int row = 0; row < PQntuples(rows->get()); ++row)
    all.append(PQgetvalue(rows->get(), row, 0), static_cast<size_t>(PQgetlength(rows->get(), row, 0)));
  return all;
}

}  // namespace locus::bench::cluster
