// Runs a scheduled scene (scene_schedule.h): the calling thread applies updates at full speed, and each reader has its
// own thread.
#ifndef LOCUS_TESTS_SUPPORT_FULL_SPEED_H_
#define LOCUS_TESTS_SUPPORT_FULL_SPEED_H_

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "core/base/mutex.h"
#include "tests/support/schedule_reader.h"

namespace locus::test {

struct FullSpeedOptions {
  uint64_t objects;
  int readers;
  uint64_t seed;
};

struct FullSpeedResult {
  uint64_t revisions = 0;
  uint64_t looks = 0;
  uint64_t past_looks = 0;
  std::string difference;  // first difference that a reader found
};

// Runs until go_on() returns false or a reader finds a difference. go_on() is called before each update, with the
// result so far.
template <class GoOn>
FullSpeedResult run_at_full_speed(const FullSpeedOptions& options, const GoOn& go_on) {
  const SceneSchedule schedule(options.objects);
  SceneSpec spec;
  spec.history = {30, uint64_t{1} << 30};
  Scene scene("full-speed", spec, 1, StaticSet::empty());
  schedule.begin(scene);
  std::atomic<bool> done{false};
  std::atomic<uint64_t> looks{0}, past_looks{0};
  Mutex mutex;
  std::string difference;
  std::vector<std::thread> readers;
  for (int i = 0; i < options.readers; ++i) {
    readers.emplace_back([&, i] {
      ScheduleReader reader(scene, schedule, options.seed + static_cast<uint64_t>(i));
      while (!done) {
        const uint64_t past_before = reader.past_looks();
        const std::string what = reader.look();
        ++looks;
        past_looks += reader.past_looks() - past_before;
        if (what.empty()) continue;
        const MutexLock lock(mutex);
        if (difference.empty()) difference = what;
        done = true;
      }
    });
  }
  FullSpeedResult result;
  while (!done && go_on(result)) {
    schedule.advance(scene, ++result.revisions);
    result.looks = looks;
    result.past_looks = past_looks;
  }
  done = true;
  for (std::thread& reader : readers) reader.join();
  result.difference = difference;
  return result;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_FULL_SPEED_H_
