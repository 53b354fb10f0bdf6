// Engine of a cluster in memory, for tests of server/cluster: obeys the contract of ClusterEngine, calls an auditor
// after each change that matters, and counts calls. It never fails: EngineLink (engine_link.h) puts faults before it.
// With a planted bug it breaks its contract, so that tests can prove that they would notice.
//
// Threads: every member function may be called from any thread, but the setters before the first call. The auditor is
// called under the lock.
#ifndef LOCUS_TESTS_SUPPORT_SIMULATED_ENGINE_H_
#define LOCUS_TESTS_SUPPORT_SIMULATED_ENGINE_H_

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "core/base/mutex.h"
#include "core/base/planted_bug.h"
#include "server/cluster/cluster_engine.h"

namespace locus::test {

// Change of a scene's leader in the engine.
struct LeaderChange {
  enum class Cause : uint8_t { kTakeOver, kHandOver };
  Cause cause = Cause::kTakeOver;
  server::LeaderRow before, after;
  bool leader_lived = false;  // the leader before was a living member
};

class SimulatedEngine : public server::ClusterEngine {
 public:
  using MemberId = server::MemberId;
  using Token = server::Token;
  using LeaderRow = server::LeaderRow;
  using MemberRow = server::MemberRow;

  std::function<void(const LeaderChange&)> on_leader_change;
  std::function<void(MemberId)> on_marked_dead;  // by another member
  std::function<void(MemberId)> on_beat;

  // Adds a scene without a leader.
  void add_scene(SceneKey key) {
    const MutexLock lock(mutex_);
    scenes_[key] = {key, 0, 0, 0, 1};
    led_[0].insert(key);
  }
  void remove_scene(SceneKey key) {
    const MutexLock lock(mutex_);
    if (const auto found = scenes_.find(key); found != scenes_.end()) {
      led_[found->second.leader].erase(key);
      scenes_.erase(found);
    }
  }
  // Makes the token of a scene higher without another leader, as its leader does to fence a lost append. Returns false
  // if leader or token differ.
  bool raise_token(SceneKey key, MemberId leader, Token token) {
    const MutexLock lock(mutex_);
    const auto found = scenes_.find(key);
    if (found == scenes_.end() || found->second.leader != leader || found->second.token != token) return false;
    ++found->second.token;
    return true;
  }
  // Returns the row of a scene. Precondition: it exists.
  LeaderRow row(SceneKey key) const {
    const MutexLock lock(mutex_);
    return scenes_.at(key);
  }
  bool lives(MemberId id) const {
    const MutexLock lock(mutex_);
    return living_.contains(id);
  }
  size_t living() const {
    const MutexLock lock(mutex_);
    return living_.size();
  }

  absl::Status join(MemberId id, const server::MemberInfo& info, uint64_t load) override {
    const MutexLock lock(mutex_);
    if (members_.contains(id) || forgotten_.contains(id)) return absl::OkStatus();
    members_[id].row = {id, info, load, 0, false};
    living_.insert(id);
    return absl::OkStatus();
  }

  absl::StatusOr<server::BeatReply> beat(MemberId id, uint64_t load, size_t watched) override {
    const MutexLock lock(mutex_);
    if (!living_.contains(id)) return absl::NotFoundError("the member is dead");
    Member& member = members_[id];
    ++member.row.beat;
    member.row.load = load;
    if (on_beat) on_beat(id);
    server::BeatReply reply;
    reply.assigned = member.assigned;
    auto next = living_.upper_bound(id);
    for (size_t i = 0; i < watched && i + 1 < living_.size(); ++i) {
      if (next == living_.end()) next = living_.begin();
      reply.next.push_back({*next, members_[*next].row.beat});
      ++next;
    }
    for (auto dead = dead_.begin(); dead != dead_.end() && reply.dead.size() < kMaxListed; ++dead)
      reply.dead.push_back(*dead);
    return reply;
  }

  absl::StatusOr<bool> mark_dead(server::SeenBeat seen) override {
    const MutexLock lock(mutex_);
    if (!living_.contains(seen.id)) return true;
    if (members_[seen.id].row.beat != seen.beat && !planted(PlantedBug::kMarkAnyBeat)) return false;
    if (on_marked_dead) on_marked_dead(seen.id);
    bury(seen.id);
    return true;
  }

  absl::Status leave(MemberId id) override {
    const MutexLock lock(mutex_);
    if (living_.contains(id)) bury(id);
    return absl::OkStatus();
  }

  absl::Status forget(MemberId id) override {
    const MutexLock lock(mutex_);
    if (living_.contains(id)) return absl::FailedPreconditionError("the member is living");
    if (const auto led = led_.find(id); led != led_.end() && !led->second.empty())
      return absl::FailedPreconditionError("the member leads scenes");
    dead_.erase(id);
    if (members_.erase(id) == 1) forgotten_.insert(id);
    return absl::OkStatus();
  }

  absl::StatusOr<std::vector<MemberRow>> members() override {
    const MutexLock lock(mutex_);
    std::vector<MemberRow> rows;
    for (const MemberId id : living_) rows.push_back(members_[id].row);
    return rows;
  }

  absl::StatusOr<std::vector<LeaderRow>> scenes_led_by(MemberId leader) override {
    const MutexLock lock(mutex_);
    return rows_of(leader);
  }

  absl::StatusOr<std::vector<LeaderRow>> scenes_without_leader() override {
    const MutexLock lock(mutex_);
    std::vector<LeaderRow> found;
    for (const auto& [leader, keys] : led_) {
      if (leader != 0 && members_.contains(leader)) continue;
      for (const LeaderRow& row : rows_of(leader))
        if (found.size() < kMaxListed) found.push_back(row);
    }
    return found;
  }

  absl::StatusOr<LeaderRow> take_over(SceneKey scene, Token seen, MemberId to) override {
    const MutexLock lock(mutex_);
    const auto found = scenes_.find(scene);
    if (found == scenes_.end()) return absl::NotFoundError("no such scene");
    if (found->second.token != seen && !planted(PlantedBug::kTakeOverAnyToken))
      return absl::AbortedError("the token has changed");
    if (!living_.contains(to)) return absl::FailedPreconditionError("the member does not live");
    return lead(found->second, to, LeaderChange::Cause::kTakeOver);
  }

  absl::StatusOr<LeaderRow> hand_over(SceneKey scene, Token token, MemberId from, MemberId to) override {
    const MutexLock lock(mutex_);
    const auto found = scenes_.find(scene);
    if (found == scenes_.end()) return absl::NotFoundError("no such scene");
    const bool same = found->second.token == token && found->second.leader == from;
    if (!same && !planted(PlantedBug::kHandOverAnyToken)) return absl::AbortedError("the leader has changed");
    if (to != 0 && !living_.contains(to)) return absl::FailedPreconditionError("the member does not live");
    return lead(found->second, to, LeaderChange::Cause::kHandOver);
  }

 private:
  struct Member {
    MemberRow row;
    uint64_t assigned = 0;
  };

  void bury(MemberId id) LOCUS_REQUIRES(mutex_) {
    members_[id].row.dead = true;
    living_.erase(id);
    dead_.insert(id);
  }

  std::vector<LeaderRow> rows_of(MemberId leader) const LOCUS_REQUIRES(mutex_) {
    std::vector<LeaderRow> rows;
    if (const auto led = led_.find(leader); led != led_.end())
      for (const SceneKey key : led->second) rows.push_back(scenes_.at(key));
    return rows;
  }

  LeaderRow lead(LeaderRow& row, MemberId to, LeaderChange::Cause cause) LOCUS_REQUIRES(mutex_) {
    const LeaderChange change = {
        cause, row, {row.key, to, row.token + 1, row.last_sequence, row.epoch}, living_.contains(row.leader)};
    led_[row.leader].erase(row.key);
    led_[to].insert(row.key);
    row = change.after;
    if (to != 0) ++members_[to].assigned;
    if (on_leader_change) on_leader_change(change);
    return row;
  }

  mutable Mutex mutex_;
  absl::flat_hash_map<MemberId, Member> members_ LOCUS_GUARDED_BY(mutex_);
  std::set<MemberId> living_ LOCUS_GUARDED_BY(mutex_);
  std::set<MemberId> dead_ LOCUS_GUARDED_BY(mutex_);
  std::set<MemberId> forgotten_ LOCUS_GUARDED_BY(mutex_);
  absl::flat_hash_map<SceneKey, LeaderRow> scenes_ LOCUS_GUARDED_BY(mutex_);
  std::map<MemberId, std::set<SceneKey>> led_ LOCUS_GUARDED_BY(mutex_);  // by leader
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SIMULATED_ENGINE_H_
