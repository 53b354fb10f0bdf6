// Times of the cluster. The defaults are those of the product; tests with threads use shorter ones. Plain data, and a
// clock. Any thread.
#ifndef LOCUS_SERVER_CLUSTER_CLUSTER_TIMING_H_
#define LOCUS_SERVER_CLUSTER_CLUSTER_TIMING_H_

#include <chrono>
#include <functional>

namespace locus::server {

// Time of the machine's monotonic clock. Times of two machines are never compared.
using ClusterTime = std::chrono::steady_clock::time_point;
using ClusterClock = std::function<ClusterTime()>;

struct ClusterTiming {
  using Duration = std::chrono::steady_clock::duration;

  // Time between two beats of a member, and the maximum of a random time that is added to each, so that the beats of
  // many members do not coincide.
  Duration beat = std::chrono::seconds(1);
  Duration jitter = std::chrono::milliseconds(64);
  // Longest time from one successful own beat to the next for which silence of others is counted.
  Duration max_gap = std::chrono::milliseconds(2500);
  // Silence after which the members that watch a member ask for the beats of more members.
  Duration quiet = std::chrono::milliseconds(2500);
  // Silence after which a member is dead.
  Duration silence = std::chrono::seconds(6);
  // Time from the start of a successful beat until the lease of the member ends. The difference to `silence` is for
  // clocks that run at different rates.
  Duration lease = std::chrono::seconds(5);
  // Time for which only the followers of a dead member's scenes may take them over.
  Duration others_wait = std::chrono::seconds(2);
  // Times between two searches for scenes without a leader, and between two comparisons of the led scenes with the
  // engine's rows without an occasion.
  Duration sweep = std::chrono::seconds(5);
  Duration reconcile = std::chrono::seconds(10);
  // Time until the next attempt after a call failed.
  Duration retry = std::chrono::milliseconds(500);
  // Age at which the table of members is read again when a scene is to be placed.
  Duration table_age = std::chrono::seconds(2);

  // Aborts unless the lease ends before a member can be declared dead, and each beat is due before the lease ends.
  void check() const;
};

// Returns the time since the start of the machine, in which the machine's sleep counts, unlike in steady_clock: a
// machine that slept for longer than the lease must not believe that it still leads.
ClusterTime time_since_boot();

}  // namespace locus::server

#endif  // LOCUS_SERVER_CLUSTER_CLUSTER_TIMING_H_
