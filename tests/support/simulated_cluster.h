// Cluster of daemons in simulated time: the real membership and leadership of each daemon over a SimulatedEngine. Each
// daemon has two threads, for beats and for scenes, whose steps the cluster runs in order of time. A step makes at most
// one call of the engine, whose time passes for its own thread only. A test can pause a daemon, cut it off from the
// engine, stop the engine, kill, start and drain daemons. The cluster checks all the time that leaders change only when
// they may, and at the end the claims of all daemons (leadership_claims.h). Equal seeds give equal runs. One thread.
#ifndef LOCUS_TESTS_SUPPORT_SIMULATED_CLUSTER_H_
#define LOCUS_TESTS_SUPPORT_SIMULATED_CLUSTER_H_

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/cluster/cluster_host.h"
#include "server/cluster/leadership.h"
#include "server/cluster/membership.h"
#include "tests/support/engine_link.h"
#include "tests/support/leadership_claims.h"
#include "tests/support/random.h"
#include "tests/support/simulated_engine.h"

namespace locus::test {

class SimulatedCluster {
 public:
  using Time = server::ClusterTime;
  using Duration = server::ClusterTiming::Duration;

  // Times of the engine, and probabilities of faults of a call.
  struct Options {
    uint64_t seed = 0;
    Duration max_latency = std::chrono::milliseconds(5);
    Duration call_timeout = std::chrono::seconds(3);
    // Time that each write takes alone in the engine; later writes wait. 0: no limit.
    Duration write_time = Duration::zero();
    double lost = 0, late = 0, never = 0, pause = 0;
    bool check_claims = true;  // false: fault() does not verify claims, which would take long in a large cluster
    server::ClusterTiming timing;
  };

  class Daemon : public server::ClusterHost {
   public:
    Daemon(SimulatedCluster& cluster, uint64_t number);

    uint64_t number() const { return number_; }
    server::Membership& membership() { return *membership_; }
    server::Leadership& leadership() { return *leadership_; }
    server::MemberId id() const { return membership_->self().id; }
    // Scenes that the host was told to lead, with their leases.
    const std::map<SceneKey, LedScene>& led() const { return led_; }

    // Functions that a test may set.
    std::function<uint64_t()> load_of_daemon = [] { return uint64_t{0}; };
    std::function<std::vector<FollowedScene>(server::MemberId)> followed_of = [](server::MemberId) {
      return std::vector<FollowedScene>();
    };
    std::function<std::vector<server::MemberId>(SceneKey)> followers_of = [](SceneKey) {
      return std::vector<server::MemberId>();
    };
    std::function<void(const LedScene&)> on_start;

    uint64_t load() override { return load_of_daemon(); }
    void start_leading(const LedScene& scene) override;
    void stop_leading(SceneKey scene, server::Token token, server::StopReason reason) override;
    void leader_changed(const server::LeaderRow&) override {}
    std::vector<FollowedScene> followed_scenes(server::MemberId leader) override { return followed_of(leader); }
    std::vector<server::MemberId> caught_up_followers(SceneKey scene) override { return followers_of(scene); }

    std::vector<server::StopReason> stops;  // reasons of all stops, in order

   private:
    friend class SimulatedCluster;
    // One of the two threads.
    struct Thread {
      Time at;                        // of its next step
      Time busy_until = Time::min();  // end of its last step
    };

    CallFate judge(CallKind kind);
    void pass_time(CallKind kind, CallFate fate);

    SimulatedCluster& cluster_;
    const uint64_t number_;
    EngineLink link_;
    std::unique_ptr<server::Membership> membership_;
    std::unique_ptr<server::Leadership> leadership_;
    Thread beats_, scenes_;
    Time away_until_;  // cut off from the engine
    std::map<SceneKey, LedScene> led_;
  };

  explicit SimulatedCluster(const Options& options) : options_(options), random_(options.seed) {
    engine_.on_leader_change = [this](const LeaderChange& change) { check(change); };
    engine_.on_marked_dead = [this](server::MemberId id) { check_marked(id); };
    engine_.on_beat = [this](server::MemberId id) { last_beats_[id] = now_; };
  }

  SimulatedEngine& engine() { return engine_; }
  Random& random() { return random_; }
  Time now() const { return now_; }
  // Returns the time of the thread that runs, which is later than now() if its call took time.
  Time thread_time() const { return local_; }
  std::vector<Daemon*> daemons() const {
    std::vector<Daemon*> all;
    for (const auto& [number, daemon] : daemons_) all.push_back(daemon.get());
    return all;
  }

  // Starts a daemon, which joins the cluster `delay` from now.
  Daemon& start(Duration delay = Duration::zero()) {
    const uint64_t number = ++last_number_;
    auto daemon = std::make_unique<Daemon>(*this, number);
    daemon->beats_.at = daemon->scenes_.at = now_ + delay;
    Daemon& started = *daemon;
    daemons_[number] = std::move(daemon);
    schedule(started);
    return started;
  }
  // Ends the process of a daemon at once.
  void kill(Daemon& daemon) {
    claims_.end_all(daemon.number_);
    unschedule(daemon);
    daemons_.erase(daemon.number_);
  }
  // Stops the process of a daemon for a time, as SIGSTOP does.
  void pause(Daemon& daemon, Duration time) {
    unschedule(daemon);
    for (Daemon::Thread* thread : {&daemon.beats_, &daemon.scenes_}) {
      thread->busy_until = std::max(thread->busy_until, now_ + time);
      thread->at = std::max(thread->at, thread->busy_until);
    }
    schedule(daemon);
  }
  // Cuts a daemon off from the engine for a time.
  void cut_off(Daemon& daemon, Duration time) { daemon.away_until_ = std::max(daemon.away_until_, now_ + time); }
  // Stops the engine for a time.
  void stop_engine(Duration time) {
    if (away_until_ < now_)
      outages_.push_back({now_, now_ + time});
    else
      outages_.back().second = std::max(away_until_, now_ + time);
    away_until_ = outages_.back().second;
  }
  void drain(Daemon& daemon) {
    permissions_[daemon.number_].drains = true;
    daemon.leadership_->drain();
  }
  // Lets a daemon make the token of a scene that it leads higher, as PostgresLog does; its leadership learns that after
  // `delay`. Returns false if another one leads the scene.
  bool raise_token(Daemon& daemon, SceneKey scene, Duration delay) {
    const auto lease = daemon.leadership_->find(scene);
    if (lease == nullptr) return false;
    const server::Token token = lease->token();
    if (!engine_.raise_token(scene, daemon.id(), token)) return false;
    execute_later(delay, [this, number = daemon.number_, scene, token] {
      const auto found = daemons_.find(number);
      if (found != daemons_.end()) found->second->leadership_->token_raised(scene, token, token + 1);
    });
    return true;
  }
  // Asks a daemon to move a scene. Until that is done, the daemon may hand this scene over to this member, once.
  void move(Daemon& daemon, SceneKey scene, server::MemberId to, server::Leadership::MoveDone done = nullptr) {
    permissions_[daemon.number_].moves.insert({scene, to});
    daemon.leadership_->move(scene, to,
                             [this, number = daemon.number_, scene, to, done = std::move(done)](const absl::Status& s) {
                               if (!s.ok()) take_permission(number, scene, to);
                               if (done) done(s);
                             });
  }
  // Returns the first daemon that was to drain and has not, or still leads or lives in the engine; else an empty
  // string.
  std::string undrained() {
    for (const auto& [number, daemon] : daemons_) {
      if (!permissions_[number].drains) continue;
      if (!daemon->leadership_->drained()) return absl::StrCat("daemon ", number, " has not drained");
      for (const auto& [member, owner] : owners_)
        if (owner == number && engine_.lives(member)) return absl::StrCat("drained daemon ", number, " is a member");
    }
    return "";
  }
  // Ends all faults.
  void heal() {
    for (auto& [number, daemon] : daemons_) daemon->away_until_ = Time();
    if (away_until_ > now_) away_until_ = outages_.back().second = now_;
    options_.lost = options_.late = options_.never = options_.pause = 0;
  }

  // Runs all steps that are due within `time`.
  void run(Duration time) {
    const Time end = now_ + time;
    while (!queue_.empty() && queue_.begin()->first <= end) step();
    now_ = local_ = end;
  }

  // Number of calls that the engine has answered so far.
  uint64_t calls(CallKind kind) const { return calls_[static_cast<size_t>(kind)]; }

  // Returns the first rule that was broken, or an empty string. Ends all claims: call it once, at the end.
  std::string fault() {
    if (fault_.empty()) fault_ = claims_.fault();
    return fault_;
  }
  // Returns the first scene of `keys` that is not led by a living member that knows it, or an empty string.
  std::string unled(const std::vector<SceneKey>& keys) {
    std::map<server::MemberId, Daemon*> members;
    for (const auto& [number, daemon] : daemons_) members[daemon->id()] = daemon.get();
    for (const SceneKey key : keys) {
      const server::LeaderRow row = engine_.row(key);
      const auto leader = members.find(row.leader);
      if (row.leader == 0 || leader == members.end()) return absl::StrCat("scene ", key, " has no living leader");
      const auto lease = leader->second->leadership().find(key);
      if (lease == nullptr || lease->token() != row.token || !lease->living() || !leader->second->led().contains(key))
        return absl::StrCat("the leader of scene ", key, " does not know it");
    }
    return "";
  }

 private:
  enum class Role : uint8_t { kBeats, kScenes, kStatement };
  // Work at one time: of a thread, or a statement that the engine executes late. The number makes the order definite.
  using Key = std::pair<Time, std::tuple<Role, uint64_t>>;

  void schedule(Daemon& daemon) {
    queue_.insert({daemon.beats_.at, {Role::kBeats, daemon.number_}});
    queue_.insert({daemon.scenes_.at, {Role::kScenes, daemon.number_}});
  }
  void unschedule(Daemon& daemon) {
    queue_.erase({daemon.beats_.at, {Role::kBeats, daemon.number_}});
    queue_.erase({daemon.scenes_.at, {Role::kScenes, daemon.number_}});
  }
  void execute_later(Duration delay, std::function<void()> statement) {
    const uint64_t key = ++last_statement_;
    statements_[key] = std::move(statement);
    queue_.insert({local_ + delay, {Role::kStatement, key}});
  }
  void wake_scenes(Daemon& daemon) {
    queue_.erase({daemon.scenes_.at, {Role::kScenes, daemon.number_}});
    daemon.scenes_.at = std::min(daemon.scenes_.at, std::max(local_, daemon.scenes_.busy_until));
    queue_.insert({daemon.scenes_.at, {Role::kScenes, daemon.number_}});
  }

  void step() {
    const auto [time, work] = *queue_.begin();
    queue_.erase(queue_.begin());
    now_ = local_ = std::max(now_, time);
    const auto [role, number] = work;
    if (role == Role::kStatement) {
      const auto statement = std::move(statements_.at(number));
      statements_.erase(number);
      statement();
      return;
    }
    Daemon& daemon = *daemons_.at(number);
    Daemon::Thread& thread = role == Role::kBeats ? daemon.beats_ : daemon.scenes_;
    thread.at = Time::max();
    queue_.insert({thread.at, work});  // so that the step may wake its own thread
    const Time next = role == Role::kBeats ? daemon.membership_->step() : daemon.leadership_->step();
    if (options_.check_claims) {
      claims_.update(number);
      check_leases(daemon);
    }
    queue_.erase({thread.at, work});
    thread.busy_until = local_;
    thread.at = std::max(std::min(thread.at, next), local_);
    queue_.insert({thread.at, work});
    local_ = now_;
  }

  // Returns the time for which the engine has been up since `from`. An outage that is shorter than the time between two
  // beats may pass unnoticed and counts as up.
  Duration up_since(Time from) const {
    Duration up = now_ - from;
    for (const auto& [begin, end] : outages_)
      if (end - begin > options_.timing.beat + options_.timing.jitter + options_.max_latency && end > from)
        up -= std::min(end, now_) - std::max(begin, from);
    return up;
  }

  void check(const LeaderChange& change) {
    const auto wrong = [&](const std::string& what) {
      if (fault_.empty()) fault_ = absl::StrCat("scene ", change.before.key, ": ", what);
    };
    if (change.after.token <= change.before.token) wrong("the token went back");
    switch (change.cause) {
      case LeaderChange::Cause::kTakeOver:
        if (change.leader_lived) wrong("taken over from a living member");
        break;
      case LeaderChange::Cause::kHandOver:
        if (!may_hand_over(change)) wrong("handed over without a drain, or a move to this member");
        break;
    }
  }
  // Removes the permission of a move. Returns false if there was none.
  bool take_permission(uint64_t daemon, SceneKey scene, server::MemberId to) {
    auto& moves = permissions_[daemon].moves;
    const auto found = moves.find({scene, to});
    if (found == moves.end()) return false;
    moves.erase(found);
    return true;
  }
  bool may_hand_over(const LeaderChange& change) {
    const auto owner = owners_.find(change.before.leader);
    if (owner == owners_.end() || change.after.leader == change.before.leader) return false;
    return take_permission(owner->second, change.before.key, change.after.leader) || permissions_[owner->second].drains;
  }
  // A lease of an earlier member must be stopped, not only expired: the host would wait for it to be renewed.
  void check_leases(const Daemon& daemon) {
    const auto member = daemon.membership_->self().lease;
    for (const auto& [scene, led] : daemon.led_)
      if (&led.lease->member() != member.get() && led.lease->state() != server::SceneLease::State::kStopped &&
          fault_.empty())
        fault_ = absl::StrCat("the lease of scene ", scene, " outlives its member");
    if (daemon.leadership_->drained() && !daemon.led_.empty() && fault_.empty())
      fault_ = absl::StrCat("daemon ", daemon.number_, " leads although it has drained");
  }
  void check_marked(server::MemberId id) {
    if (up_since(last_beats_[id]) < options_.timing.silence && fault_.empty())
      fault_ = absl::StrCat("member ", id, " was declared dead although the engine had its beat");
  }

  Options options_;
  Random random_;
  SimulatedEngine engine_;
  Time now_ = Time(std::chrono::hours(1));
  Time local_ = now_;  // of the thread that runs
  LeadershipClaims claims_{local_};
  std::map<uint64_t, std::unique_ptr<Daemon>> daemons_;
  uint64_t last_number_ = 0;
  std::set<Key> queue_;
  std::map<uint64_t, std::function<void()>> statements_;
  uint64_t last_statement_ = 0;
  Time away_until_;  // the engine is away until then
  std::vector<std::pair<Time, Time>> outages_;
  Time engine_free_at_ = Time::min();
  std::map<server::MemberId, Time> last_beats_;  // that the engine has executed
  // Orders that a daemon was given, by its number; they stay when the daemon is killed, because statements may be late.
  struct Permission {
    bool drains = false;
    std::multiset<std::pair<SceneKey, server::MemberId>> moves;  // to this member
  };
  std::map<uint64_t, Permission> permissions_;
  std::map<server::MemberId, uint64_t> owners_;  // numbers of the daemons whose members these are
  uint64_t calls_[3] = {};
  std::string fault_;
};

inline SimulatedCluster::Daemon::Daemon(SimulatedCluster& cluster, uint64_t number)
    : cluster_(cluster),
      number_(number),
      link_(
          cluster.engine_, [this](CallKind kind) { return judge(kind); },
          [this](std::function<void()> statement) {
            cluster_.execute_later(std::chrono::milliseconds(cluster_.random_.below(15000)), std::move(statement));
          },
          [this](CallKind kind, CallFate fate) { pass_time(kind, fate); }) {
  const auto clock = [this] { return cluster_.local_; };
  const auto random = [this] { return cluster_.random_.next(); };
  const auto wake = [this] {
    if (cluster_.daemons_.contains(number_)) cluster_.wake_scenes(*this);
  };
  membership_ =
      std::make_unique<server::Membership>(link_, server::Membership::Options{{absl::StrCat("daemon-", number), "", ""},
                                                                              [this] { return load(); },
                                                                              wake,
                                                                              clock,
                                                                              random,
                                                                              cluster.options_.timing});
  leadership_ = std::make_unique<server::Leadership>(
      link_, *membership_, *this, server::Leadership::Options{wake, clock, random, cluster.options_.timing});
}

inline void SimulatedCluster::Daemon::start_leading(const LedScene& scene) {
  if (!led_.emplace(scene.row.key, scene).second) cluster_.fault_ = "a scene was started twice";
  if (cluster_.options_.check_claims) cluster_.claims_.begin(number_, scene.lease);
  if (on_start) on_start(scene);
}

inline void SimulatedCluster::Daemon::stop_leading(SceneKey scene, server::Token token, server::StopReason reason) {
  const auto led = led_.find(scene);
  if (led == led_.end() || led->second.lease->token() != token)
    cluster_.fault_ = "a scene was stopped that was not led";
  else
    led_.erase(led);
  stops.push_back(reason);
  cluster_.claims_.end(number_, scene, token);
}

inline CallFate SimulatedCluster::Daemon::judge(CallKind) {
  if (const server::MemberId id = membership_->self().id; id != 0) cluster_.owners_[id] = number_;
  if (cluster_.local_ < std::max(away_until_, cluster_.away_until_)) return CallFate::kNever;
  const Options& options = cluster_.options_;
  const double draw = cluster_.random_.unit();
  if (draw < options.lost) return CallFate::kLost;
  if (draw < options.lost + options.late) return CallFate::kLate;
  if (draw < options.lost + options.late + options.never) return CallFate::kNever;
  return CallFate::kAnswered;
}

inline void SimulatedCluster::Daemon::pass_time(CallKind kind, CallFate fate) {
  const Options& options = cluster_.options_;
  Time& local = cluster_.local_;
  const auto up_to = [&](Duration most) {
    return Duration(cluster_.random_.below(static_cast<uint64_t>(most.count()) + 1));
  };
  switch (fate) {
    case CallFate::kAnswered:
      ++cluster_.calls_[static_cast<size_t>(kind)];
      if (kind != CallKind::kRead && options.write_time > Duration::zero()) {
        cluster_.engine_free_at_ = std::max(cluster_.engine_free_at_, local) + options.write_time;
        local = cluster_.engine_free_at_;
      }
      local += up_to(options.max_latency);
      break;
    case CallFate::kLost:
      local += up_to(options.call_timeout);
      break;
    case CallFate::kLate:
      local += options.call_timeout;
      break;
    case CallFate::kNever:  // the connection is refused at once, or nothing answers
      local += cluster_.random_.chance(0.5) ? up_to(options.max_latency) : options.call_timeout;
      break;
  }
  if (options.pause > 0 && cluster_.random_.chance(options.pause)) {
    // The process is stopped between the engine's answer and its use.
    const Duration time = up_to(std::chrono::seconds(20));
    local += time;
    for (Thread* thread : {&beats_, &scenes_}) {
      if (thread->at == Time::max()) continue;  // the thread that runs
      const Role role = thread == &beats_ ? Role::kBeats : Role::kScenes;
      cluster_.queue_.erase({thread->at, {role, number_}});
      thread->busy_until = std::max(thread->busy_until, local);
      thread->at = std::max(thread->at, local);
      cluster_.queue_.insert({thread->at, {role, number_}});
    }
  }
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SIMULATED_CLUSTER_H_
