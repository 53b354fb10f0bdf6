// ClusterEngine on the replicated PostgreSQL in which PostgresLog stores the scenes. The table `member` has the
// members; `scene_log` has leader and token of each scene, which PostgresLog names in each append.
//
// Threads: any thread may call any member. Calls wait for the engine, at most for PostgresOptions::answer_wait for a
// connection and as long for its answer. Two or three connections are open as a rule; beats have their own, so
// that they wait neither for the bytes of scenes nor for other calls. Every failure of the engine is UNAVAILABLE, also
// if it acknowledges before a second machine has synced.
#ifndef LOCUS_SERVER_STORAGE_POSTGRES_CLUSTER_H_
#define LOCUS_SERVER_STORAGE_POSTGRES_CLUSTER_H_

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "server/cluster/cluster_engine.h"
#include "server/storage/postgres_log.h"

namespace locus::server {

class PostgresCluster final : public ClusterEngine {
 public:
  // Connects and creates the tables if the database has none. Errors: those of PostgresLog::open().
  static absl::StatusOr<std::unique_ptr<PostgresCluster>> open(const PostgresOptions& options);

  absl::Status join(MemberId id, const MemberInfo& info, uint64_t load) override;
  absl::StatusOr<BeatReply> beat(MemberId id, uint64_t load, size_t watched) override;
  absl::StatusOr<bool> mark_dead(SeenBeat seen) override;
  absl::Status leave(MemberId id) override;
  absl::Status forget(MemberId id) override;
  absl::StatusOr<std::vector<MemberRow>> members() override;

  absl::StatusOr<std::vector<LeaderRow>> scenes_led_by(MemberId leader) override;
  absl::StatusOr<std::vector<LeaderRow>> scenes_without_leader() override;
  absl::StatusOr<LeaderRow> take_over(SceneKey scene, Token seen, MemberId to) override;
  absl::StatusOr<LeaderRow> hand_over(SceneKey scene, Token token, MemberId from, MemberId to) override;

 private:
  PostgresCluster(const PostgresOptions& options, EngineAddress address);

  // Returns a connection; no attempt is repeated, because the members decide what to do next.
  absl::StatusOr<EnginePool::Lease> acquire(EnginePool::Use use) const;
  Deadline answer_deadline() const { return std::chrono::steady_clock::now() + options_.answer_wait; }
  // Runs the added statements. Every failure of the engine becomes UNAVAILABLE.
  absl::Status run(EngineConnection& connection) const;
  // Makes `to` the leader if the token is `token` and, unless `from` has no value, the leader is `from`.
  absl::StatusOr<LeaderRow> change_leader(SceneKey scene, Token token, std::optional<MemberId> from, MemberId to) const;

  const PostgresOptions options_;
  mutable EnginePool pool_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_POSTGRES_CLUSTER_H_
