#include "server/storage/postgres_cluster.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/storage/postgres/tables.h"

namespace locus::server {
namespace {

// Begins a statement whose rows leader_rows() reads.
#define LOCUS_LEADER_ROWS \
  "SELECT l.scene, l.leader, l.token, l.last, s.epoch FROM locus.scene_log l JOIN locus.scene s ON s.key = l.scene "

LeaderRow leader_row(const EngineRows& rows, size_t row) {
  return {rows.number(row, 0), rows.number(row, 1), rows.number(row, 2), rows.number(row, 3), rows.number(row, 4)};
}

std::vector<LeaderRow> leader_rows(const EngineRows& rows) {
  std::vector<LeaderRow> found;
  for (size_t row = 0; row < rows.size(); ++row) found.push_back(leader_row(rows, row));
  return found;
}

}  // namespace

absl::StatusOr<std::unique_ptr<PostgresCluster>> PostgresCluster::open(const PostgresOptions& options) {
  ASSIGN_OR_RETURN(EngineAddress address, EngineAddress::parse(options.url));
  std::unique_ptr<PostgresCluster> cluster(new PostgresCluster(options, std::move(address)));
  RETURN_IF_ERROR(cluster->pool_.acquire(EnginePool::Use::kOther, cluster->answer_deadline()).status());
  return cluster;
}

PostgresCluster::PostgresCluster(const PostgresOptions& options, EngineAddress address)
    : options_(options),
      pool_(std::move(address), options.connect_wait,
            [replication = options.replication](EngineConnection& connection, Deadline deadline) -> absl::Status {
              RETURN_IF_ERROR(check_engine(connection, replication, deadline));
              return prepare_tables(connection, deadline);
            }) {}

absl::StatusOr<EnginePool::Lease> PostgresCluster::acquire(EnginePool::Use use) const {
  absl::StatusOr<EnginePool::Lease> lease = pool_.acquire(use, answer_deadline());
  if (!lease.ok()) return absl::UnavailableError(lease.status().message());
  return lease;
}

absl::Status PostgresCluster::run(EngineConnection& connection) const {
  absl::Status status = run_checked(connection, options_.replication, answer_deadline());
  return status.ok() ? status : absl::UnavailableError(status.message());
}

absl::Status PostgresCluster::join(MemberId id, const MemberInfo& info, uint64_t load) {
  ASSIGN_OR_RETURN(const EnginePool::Lease lease, acquire(EnginePool::Use::kUrgent));
  lease->add(
      "INSERT INTO locus.member (id, address, zone, version, load, beat, dead, assigned, forgotten)"
      " VALUES ($1::bigint, $2::text, $3::text, $4::text, $5::bigint, 0, 0, 0, 0) ON CONFLICT (id) DO NOTHING",
      SqlParameters().number(id).text(info.address).text(info.zone).text(info.version).number(load));
  add_barrier(*lease);
  return run(*lease);
}

absl::StatusOr<BeatReply> PostgresCluster::beat(MemberId id, uint64_t load, size_t watched) {
  ASSIGN_OR_RETURN(const EnginePool::Lease lease, acquire(EnginePool::Use::kUrgent));
  lease->add(
      "UPDATE locus.member SET beat = beat + 1, load = $2::bigint WHERE id = $1::bigint AND dead = 0 RETURNING "
      "assigned",
      SqlParameters().number(id).number(load));
  // Two statements, each a short walk in the index: the members after this one, and the ring's beginning.
  lease->add("SELECT id, beat FROM locus.member WHERE dead = 0 AND id > $1::bigint ORDER BY id LIMIT $2::bigint",
             SqlParameters().number(id).number(watched));
  lease->add("SELECT id, beat FROM locus.member WHERE dead = 0 AND id < $1::bigint ORDER BY id LIMIT $2::bigint",
             SqlParameters().number(id).number(watched));
  lease->add("SELECT id FROM locus.member WHERE dead = 1 ORDER BY id LIMIT $1::bigint",
             SqlParameters().number(kMaxListed));
  add_barrier(*lease);
  RETURN_IF_ERROR(run(*lease));
  const std::vector<EngineRows>& results = lease->results();
  if (results[0].empty()) return absl::NotFoundError("the member is dead or was forgotten");
  BeatReply reply;
  reply.assigned = results[0].number(0, 0);
  for (const size_t part : {1, 2})
    for (size_t row = 0; row < results[part].size() && reply.next.size() < watched; ++row)
      reply.next.push_back({results[part].number(row, 0), results[part].number(row, 1)});
  for (size_t row = 0; row < results[3].size(); ++row) reply.dead.push_back(results[3].number(row, 0));
  return reply;
}

absl::StatusOr<bool> PostgresCluster::mark_dead(SeenBeat seen) {
  ASSIGN_OR_RETURN(const EnginePool::Lease lease, acquire(EnginePool::Use::kOther));
  lease->add("UPDATE locus.member SET dead = 1 WHERE id = $1::bigint AND beat = $2::bigint AND dead = 0",
             SqlParameters().number(seen.id).number(seen.beat));
  lease->add("SELECT id FROM locus.member WHERE id = $1::bigint AND dead = 0", SqlParameters().number(seen.id));
  add_barrier(*lease);
  RETURN_IF_ERROR(run(*lease));
  return lease->results()[1].empty();
}

absl::Status PostgresCluster::leave(MemberId id) {
  ASSIGN_OR_RETURN(const EnginePool::Lease lease, acquire(EnginePool::Use::kUrgent));
  lease->add("UPDATE locus.member SET dead = 1 WHERE id = $1::bigint AND dead = 0", SqlParameters().number(id));
  add_barrier(*lease);
  return run(*lease);
}

absl::Status PostgresCluster::forget(MemberId id) {
  ASSIGN_OR_RETURN(const EnginePool::Lease lease, acquire(EnginePool::Use::kOther));
  // A dead member gets no scene, so it leads none afterwards either. The row of a forgotten member (dead = 2) stays for
  // a day, in which a late join() finds it.
  lease->add(
      "UPDATE locus.member SET dead = 2, forgotten = extract(epoch FROM now())::bigint WHERE id = $1::bigint"
      " AND dead = 1 AND NOT EXISTS (SELECT FROM locus.scene_log WHERE leader = $1::bigint)",
      SqlParameters().number(id));
  lease->add("SELECT dead FROM locus.member WHERE id = $1::bigint AND dead < 2", SqlParameters().number(id));
  lease->add("DELETE FROM locus.member WHERE dead = 2 AND forgotten < extract(epoch FROM now())::bigint - 86400");
  add_barrier(*lease);
  RETURN_IF_ERROR(run(*lease));
  const EngineRows& left = lease->results()[1];
  if (left.empty()) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("member ", id, left.number(0, 0) == 0 ? " is living" : " leads scenes"));
}

absl::StatusOr<std::vector<MemberRow>> PostgresCluster::members() {
  ASSIGN_OR_RETURN(const EnginePool::Lease lease, acquire(EnginePool::Use::kOther));
  lease->add("SELECT id, address, zone, version, load, beat FROM locus.member WHERE dead = 0 ORDER BY id");
  add_barrier(*lease);
  RETURN_IF_ERROR(run(*lease));
  const EngineRows& found = lease->results()[0];
  std::vector<MemberRow> members;
  for (size_t row = 0; row < found.size(); ++row)
    members.push_back(
        {found.number(row, 0),
         {std::string(found.bytes(row, 1)), std::string(found.bytes(row, 2)), std::string(found.bytes(row, 3))},
         found.number(row, 4),
         found.number(row, 5),
         false});
  return members;
}

absl::StatusOr<std::vector<LeaderRow>> PostgresCluster::scenes_led_by(MemberId leader) {
  ASSIGN_OR_RETURN(const EnginePool::Lease lease, acquire(EnginePool::Use::kOther));
  lease->add(LOCUS_LEADER_ROWS "WHERE l.leader = $1::bigint ORDER BY l.scene", SqlParameters().number(leader));
  add_barrier(*lease);
  RETURN_IF_ERROR(run(*lease));
  return leader_rows(lease->results()[0]);
}

absl::StatusOr<std::vector<LeaderRow>> PostgresCluster::scenes_without_leader() {
  ASSIGN_OR_RETURN(const EnginePool::Lease lease, acquire(EnginePool::Use::kOther));
  lease->add(
      LOCUS_LEADER_ROWS
      "LEFT JOIN locus.member m ON m.id = l.leader AND m.dead < 2 WHERE m.id IS NULL ORDER BY l.scene LIMIT $1::bigint",
      SqlParameters().number(kMaxListed));
  add_barrier(*lease);
  RETURN_IF_ERROR(run(*lease));
  return leader_rows(lease->results()[0]);
}

absl::StatusOr<LeaderRow> PostgresCluster::take_over(SceneKey scene, Token seen, MemberId to) {
  return change_leader(scene, seen, std::nullopt, to);
}

absl::StatusOr<LeaderRow> PostgresCluster::hand_over(SceneKey scene, Token token, MemberId from, MemberId to) {
  return change_leader(scene, token, from, to);
}

absl::StatusOr<LeaderRow> PostgresCluster::change_leader(SceneKey scene, Token token, std::optional<MemberId> from,
                                                         MemberId to) const {
  ASSIGN_OR_RETURN(const EnginePool::Lease lease, acquire(EnginePool::Use::kOther));
  // One round trip, so that no lock waits for this daemon. The lock of the member's row keeps it from being marked dead
  // until the commit; it is taken first by each change of a leader.
  lease->add("SELECT id FROM locus.member WHERE id = $1::bigint AND dead = 0 FOR NO KEY UPDATE",
             SqlParameters().number(to));
  lease->add(
      "WITH led AS (UPDATE locus.scene_log SET leader = $3::bigint, token = token + 1"
      " WHERE scene = $1::bigint AND token = $2::bigint AND ($5::bigint = 0 OR leader = $4::bigint)"
      " AND ($3::bigint = 0 OR EXISTS (SELECT FROM locus.member WHERE id = $3::bigint AND dead = 0))"
      " RETURNING scene, leader, token, last),"
      " counted AS (UPDATE locus.member SET assigned = assigned + 1"
      " WHERE id = $3::bigint AND EXISTS (SELECT FROM led))"
      " SELECT l.scene, l.leader, l.token, l.last, s.epoch FROM led l JOIN locus.scene s ON s.key = l.scene",
      SqlParameters().number(scene).number(token).number(to).number(from.value_or(0)).number(from ? 1 : 0));
  lease->add(LOCUS_LEADER_ROWS "WHERE l.scene = $1::bigint", SqlParameters().number(scene));
  add_barrier(*lease);
  RETURN_IF_ERROR(run(*lease));
  const EngineRows& changed = lease->results()[1];
  if (!changed.empty()) return leader_row(changed, 0);
  const EngineRows& present = lease->results()[2];
  if (present.empty()) return absl::NotFoundError(absl::StrCat("the engine has no scene ", scene));
  const LeaderRow row = leader_row(present, 0);
  if (row.token != token || (from && row.leader != *from))
    return absl::AbortedError(absl::StrCat("scene ", scene, " has another leader: its token is ", row.token));
  return absl::FailedPreconditionError(absl::StrCat("member ", to, " is not living"));
}

}  // namespace locus::server
