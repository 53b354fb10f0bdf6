// The real placement and takeover code at the size of an internet service, in simulated time: 1,000 daemons that lead
// 100,000 scenes whose loads are heavy-tailed, and an engine that executes 3,000 writes a second, one after another.
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <vector>

#include "server/cluster/leadership.h"
#include "tests/support/simulated_cluster.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

using std::chrono::duration;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;
using test::CallKind;
using test::SimulatedCluster;

constexpr double kWritesPerSecond = 3000;
constexpr uint64_t kCreating = 50;  // daemons through which clients create scenes

class LargeCluster {
 public:
  LargeCluster(uint64_t seed, uint64_t daemons, uint64_t scenes) : cluster_(options(seed)), loads_(scenes + 1) {
    draw_loads(daemons);
    for (uint64_t number = 0; number < daemons; ++number) add_daemon();
    cluster_.run(seconds(5));
  }

  // Creates all scenes, `rate` of them a second. Their loads are not known until they are led.
  void create_scenes(uint64_t rate) {
    const std::vector<SimulatedCluster::Daemon*> daemons = cluster_.daemons();
    for (SceneKey key = 1; key < loads_.size(); ++key) {
      cluster_.engine().add_scene(key);
      ASSERT_TRUE(daemons[cluster_.random().below(std::min<uint64_t>(kCreating, daemons.size()))]
                      ->leadership()
                      .place(key)
                      .ok());
      keys_.push_back(key);
      cluster_.run(nanoseconds(seconds(1)) / rate);
    }
    cluster_.run(seconds(5));
  }
  // Returns the load of the busiest daemon, divided by the mean load of the daemons.
  double busiest_by_mean() const {
    uint64_t sum = 0, busiest = 0;
    const std::vector<SimulatedCluster::Daemon*> daemons = cluster_.daemons();
    for (SimulatedCluster::Daemon* daemon : daemons) {
      sum += daemon->load();
      busiest = std::max(busiest, daemon->load());
    }
    return static_cast<double>(busiest) * static_cast<double>(daemons.size()) / static_cast<double>(sum);
  }
  // Returns what busiest_by_mean() would be if each scene were placed on a random daemon, as by a hash.
  double busiest_by_hash() {
    std::vector<uint64_t> sums(cluster_.daemons().size());
    uint64_t sum = 0;
    for (const SceneKey key : keys_) {
      sums[cluster_.random().below(sums.size())] += loads_[key];
      sum += loads_[key];
    }
    return static_cast<double>(*std::max_element(sums.begin(), sums.end())) * static_cast<double>(sums.size()) /
           static_cast<double>(sum);
  }
  // Kills a third of the daemons at one moment. Returns the number of scenes that they led.
  uint64_t kill_a_third() {
    uint64_t lost = 0;
    for (SimulatedCluster::Daemon* daemon : cluster_.daemons()) {
      if (daemon->number() % 3 != 0) continue;
      lost += daemon->led().size();
      cluster_.kill(*daemon);
    }
    started_ = 0;
    return lost;
  }
  // Returns the share of the engine's writes that beats take during `time`.
  double share_of_beats(seconds time) {
    const uint64_t before = cluster_.calls(CallKind::kBeat);
    cluster_.run(time);
    return static_cast<double>(cluster_.calls(CallKind::kBeat) - before) /
           (static_cast<double>(time.count()) * kWritesPerSecond);
  }

  SimulatedCluster& cluster() { return cluster_; }
  const std::vector<SceneKey>& keys() const { return keys_; }
  uint64_t started() const { return started_; }           // scenes that daemons began to lead
  ClusterTime last_start() const { return last_start_; }  // time at which the last of them began

 private:
  static SimulatedCluster::Options options(uint64_t seed) {
    SimulatedCluster::Options options;
    options.seed = seed;
    options.check_claims = false;
    options.write_time = nanoseconds(static_cast<int64_t>(1e9 / kWritesPerSecond));
    return options;
  }
  // Draws loads of a Pareto distribution with shape 1.5: the largest hundredth of the scenes has a fifth of the load.
  // No scene is larger than the mean load of a daemon, because such a scene belongs on a machine of its own.
  void draw_loads(uint64_t daemons) {
    const double largest = 1.5 * static_cast<double>(loads_.size()) / static_cast<double>(daemons);
    for (uint64_t& load : loads_)
      load = static_cast<uint64_t>(100 * std::min(largest, std::pow(1 - cluster_.random().unit(), -1 / 1.5)));
  }
  void add_daemon() {
    SimulatedCluster::Daemon& daemon = cluster_.start(milliseconds(cluster_.random().below(1000)));
    daemon.load_of_daemon = [this, &daemon] {
      uint64_t load = 0;
      for (const auto& [key, scene] : daemon.led()) load += loads_[key];
      return load;
    };
    daemon.on_start = [this](const ClusterHost::LedScene&) {
      ++started_;
      last_start_ = cluster_.thread_time();
    };
  }

  SimulatedCluster cluster_;
  std::vector<uint64_t> loads_;  // by key
  std::vector<SceneKey> keys_;
  uint64_t started_ = 0;
  ClusterTime last_start_;
};

TEST(LeadershipScaleTest, AThirdOfAThousandDaemonsIsLostAndAllScenesAreLedAgain) {
  const uint64_t daemons = test::scaled_count(1000);
  LargeCluster large(1, daemons, 100 * daemons);
  large.create_scenes(500);
  EXPECT_EQ(large.cluster().unled(large.keys()), "");
  const double busiest = large.busiest_by_mean();
  const double by_hash = large.busiest_by_hash();
  const double beats = large.share_of_beats(seconds(10));
  const ClusterTime killed = large.cluster().now();
  const uint64_t lost = large.kill_a_third();
  large.cluster().run(seconds(40));
  EXPECT_EQ(large.cluster().unled(large.keys()), "");
  EXPECT_EQ(large.cluster().fault(), "");
  EXPECT_EQ(large.started(), lost) << "only the lost scenes changed their leaders";
  const double led_again = duration<double>(large.last_start() - killed).count();
  std::printf(
      "%ju daemons, %zu scenes: busiest %.2f of the mean (by hash %.2f); beats %.3f of the engine; %ju scenes lost, "
      "all led "
      "again after %.1f s; busiest then %.2f of the mean\n",
      static_cast<uintmax_t>(daemons), large.keys().size(), busiest, by_hash, beats, static_cast<uintmax_t>(lost),
      led_again, large.busiest_by_mean());
  EXPECT_LE(busiest, 2);
  EXPECT_LT(busiest, by_hash);
  EXPECT_LE(beats, 1.0 / 3);
  EXPECT_LE(led_again, 30);
}

}  // namespace
}  // namespace locus::server
