// Log entries about scenes whose histories forget ticks early: ticks that the scene was created to retain, but that do
// not fit into its memory. One entry for each scene and episode. An episode ends when the scene has retained all its
// ticks for kEpisodeGap.
//
// Threads: one thread at a time uses an object. Cost of check(): O(scenes).
#ifndef LOCUS_SERVER_HOST_HISTORY_NOTICES_H_
#define LOCUS_SERVER_HOST_HISTORY_NOTICES_H_

#include <chrono>
#include <cstdint>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/scene/registry.h"

namespace locus::server {

class HistoryNotices {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::minutes kEpisodeGap{10};

  // Logs each scene in `scenes` that forgets ticks early and has not been logged in this episode. `scenes` are all
  // scenes of the server. Call it periodically.
  void check(const std::vector<ScenePtr>& scenes, Time now);

 private:
  absl::flat_hash_map<uint64_t, Time> last_short_;  // scenes in an episode, by epoch: last time they lacked ticks
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_HOST_HISTORY_NOTICES_H_
