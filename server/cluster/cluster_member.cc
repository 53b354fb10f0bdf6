#include "server/cluster/cluster_member.h"

#include <algorithm>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>

#include "core/base/mutex.h"

namespace locus::server {
namespace {

// Result of a move that a thread waits for. The status crosses threads as code and message: ThreadSanitizer does not
// see the reference counts of absl::Status, whose library is not instrumented.
struct MoveResult {
  Mutex mutex;
  ConditionVariable known;
  std::optional<absl::StatusCode> code LOCUS_GUARDED_BY(mutex);
  std::string message LOCUS_GUARDED_BY(mutex);
};

RandomBits generator(uint64_t seed) {
  return [engine = std::mt19937_64(seed)]() mutable { return engine(); };
}

}  // namespace

ClusterMember::ClusterMember(ClusterEngine& engine, ClusterHost& host, Options options)
    : options_(std::move(options)),
      membership_(engine, {options_.info, [&host] { return host.load(); }, [this] { wake_scenes(); }, options_.clock,
                           generator(options_.seed), options_.timing}),
      leadership_(engine, membership_, host,
                  {[this] { wake_scenes(); }, options_.clock, generator(~options_.seed), options_.timing}) {
  beats_task_ = beats_.add(beats_.now(), [this](Time now) -> std::optional<Time> {
    last_beat_.store(now.time_since_epoch().count());
    return keeper_time(membership_.step());
  });
  scenes_task_ =
      scenes_.add(scenes_.now(), [this](Time) -> std::optional<Time> { return keeper_time(leadership_.step()); });
}

ClusterMember::~ClusterMember() { stop(); }

void ClusterMember::start() {
  beats_.start();
  scenes_.start();
}

void ClusterMember::stop() {
  beats_.stop();
  scenes_.stop();
  leadership_.end();
}

ClusterMember::Time ClusterMember::keeper_time(ClusterTime time) const {
  if (time == ClusterTime::max()) return Time::max();
  return std::chrono::steady_clock::now() + (time - options_.clock());
}

void ClusterMember::wake_scenes() { scenes_.expedite(scenes_task_, scenes_.now()); }

void ClusterMember::look_soon() {
  leadership_.reconcile_soon();
  const Time last{Time::duration(last_beat_.load())};
  const Time now = beats_.now();
  beats_.expedite(beats_task_, last == Time::min() ? now : std::max(now, last + kMinBeatInterval));
}

absl::Status ClusterMember::move(SceneKey scene, MemberId to, std::chrono::steady_clock::time_point deadline) {
  const auto result = std::make_shared<MoveResult>();
  leadership_.move(scene, to, [result](const absl::Status& status) {
    const MutexLock lock(result->mutex);
    result->code = status.code();
    result->message = std::string(status.message());
    result->known.notify_all();
  });
  const MutexLock lock(result->mutex);
  while (!result->code)
    if (!result->known.wait_until(result->mutex, deadline) && !result->code)
      return absl::DeadlineExceededError(
          "the engine of the cluster did not answer in time; the scene may be moved later");
  return {*result->code, result->message};
}

bool ClusterMember::drain(std::chrono::steady_clock::time_point deadline) {
  leadership_.drain();
  beats_.expedite(beats_task_, beats_.now());  // the others learn at once that this member takes no scenes
  while (!leadership_.drained() && std::chrono::steady_clock::now() < deadline) std::this_thread::sleep_for(kDrainPoll);
  return leadership_.drained();
}

}  // namespace locus::server
