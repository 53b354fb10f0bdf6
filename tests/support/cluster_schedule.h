// Random schedules for a simulated cluster: pauses, partitions, an engine that is away, kills, restarts, drains, moves
// and new scenes, while calls fail in every way. run_cluster_schedule() returns the first rule that was broken, or an
// empty string. One thread.
#ifndef LOCUS_TESTS_SUPPORT_CLUSTER_SCHEDULE_H_
#define LOCUS_TESTS_SUPPORT_CLUSTER_SCHEDULE_H_

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/support/simulated_cluster.h"

namespace locus::test {

class ClusterSchedule {
 public:
  using Daemon = SimulatedCluster::Daemon;

  explicit ClusterSchedule(uint64_t seed) : cluster_(options(seed)), random_(seed ^ 0x5CED) {
    for (uint64_t daemon = 0; daemon < kDaemons; ++daemon) start();
    for (int scene = 0; scene < 3; ++scene) add_scene();
  }

  // Runs random actions, then ends all faults and verifies that every scene is led again.
  std::string run() {
    for (int action = 0; action < kActions; ++action) {
      cluster_.run(std::chrono::milliseconds(random_.below(4000)));
      act();
      remember();
    }
    cluster_.heal();
    for (int daemon = 0; daemon < 2; ++daemon) start();  // the others may have drained
    cluster_.run(std::chrono::seconds(60));
    const std::string unled = cluster_.unled(scenes_), undrained = cluster_.undrained();
    const std::string fault = cluster_.fault();
    if (!fault.empty()) return fault;
    return unled.empty() ? undrained : unled;
  }

 private:
  static constexpr uint64_t kDaemons = 4;
  static constexpr uint64_t kMaxDaemons = 6;
  static constexpr int kActions = 30;

  static SimulatedCluster::Options options(uint64_t seed) {
    Random random(seed);
    SimulatedCluster::Options options;
    options.seed = random.next();
    options.max_latency = std::chrono::milliseconds(random.pick(std::vector<int>{1, 20, 400}));
    // Some schedules have calls without faults, so that other faults meet a cluster at work.
    const double scale = random.pick(std::vector<double>{0, 0.2, 1});
    options.lost = 0.03 * scale;
    options.late = 0.02 * scale;
    options.never = 0.03 * scale;
    options.pause = 0.01 * scale;
    return options;
  }

  void start() {
    Daemon& daemon = cluster_.start(std::chrono::milliseconds(random_.below(1000)));
    const uint64_t number = daemon.number();
    daemon.followed_of = [this, number](server::MemberId leader) {
      std::vector<server::ClusterHost::FollowedScene> followed;
      for (const auto& [scene, row] : known_[number])
        if (row.leader == leader) followed.push_back({scene, row.token});
      return followed;
    };
    daemon.followers_of = [this](SceneKey scene) {
      std::vector<server::MemberId> followers;
      for (Daemon* other : cluster_.daemons())
        if (known_[other->number()].contains(scene)) followers.push_back(other->id());
      return followers;
    };
    const SceneKey shift = random_.below(1000);
    daemon.load_of_daemon = [shift, &daemon] { return shift + 1000 * daemon.led().size(); };
  }
  void add_scene() {
    scenes_.push_back(scenes_.size() + 1);
    cluster_.engine().add_scene(scenes_.back());
  }
  // Lets followers hear of the leaders of their scenes. Each follows half of the scenes, and hears late.
  void remember() {
    for (Daemon* daemon : cluster_.daemons())
      for (const SceneKey scene : scenes_)
        if ((daemon->number() + scene) % 2 == 0 && random_.chance(0.3))
          known_[daemon->number()][scene] = cluster_.engine().row(scene);
  }

  void act() {
    const std::vector<Daemon*> daemons = cluster_.daemons();
    if (daemons.empty()) return start();
    Daemon& daemon = *random_.pick(daemons);
    const auto time = std::chrono::milliseconds(random_.below(20000));
    switch (random_.below(14)) {
      case 0:
      case 1:
        return cluster_.pause(daemon, time);
      case 2:
      case 3:
        return cluster_.cut_off(daemon, time);
      case 4:
        return cluster_.stop_engine(time);
      case 5:
        return cluster_.kill(daemon);
      case 6:
      case 7:
        if (daemons.size() < kMaxDaemons) start();
        return;
      case 8:
        return cluster_.drain(daemon);
      case 9:
      case 10: {
        const SceneKey scene = random_.pick(scenes_);
        return cluster_.move(daemon, scene, random_.pick(daemons)->id());
      }
      case 11:
      case 12: {
        const SceneKey scene = random_.pick(scenes_);
        (void)cluster_.raise_token(daemon, scene, std::chrono::milliseconds(random_.below(500)));
        return;
      }
      case 13:
        add_scene();
        if (random_.chance(0.5)) (void)daemon.leadership().place(scenes_.back());
        return;
    }
  }

  // Rows of the scenes as each daemon, by number, has heard of them. Destroyed after the cluster.
  std::map<uint64_t, std::map<SceneKey, server::LeaderRow>> known_;
  std::vector<SceneKey> scenes_;
  SimulatedCluster cluster_;
  Random random_;
};

inline std::string run_cluster_schedule(uint64_t seed) {
  const std::string fault = ClusterSchedule(seed).run();
  return fault.empty() ? fault : absl::StrCat("seed ", seed, ": ", fault);
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_CLUSTER_SCHEDULE_H_
