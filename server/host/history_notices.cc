#include "server/host/history_notices.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/observability/log.h"

namespace locus::server {
namespace {

void log_short(const Scene& scene, const SceneSnapshot& snapshot) {
  const bool too_small = snapshot.past_limit == PastLimit::kBytes;
  const std::string hint = too_small ? "create the scene with more history_bytes or fewer history_ticks"
                                     : "give the server a larger --memory-limit, or scenes a smaller history_bytes";
  log(LogLevel::kWarning, "history is shorter than asked for: its oldest ticks were dropped",
      {{"scene", scene.name()},
       {"asked_ticks", absl::StrCat(scene.spec().history.ticks)},
       {"kept_ticks", absl::StrCat(snapshot.history == nullptr ? 0 : snapshot.history->records.size())},
       {"reason", too_small ? "history_bytes" : "memory"},
       {"history_bytes", absl::StrCat(scene.spec().history.bytes)},
       {"hint", hint}});
}

}  // namespace

void HistoryNotices::check(const std::vector<ScenePtr>& scenes, Time now) {
  absl::flat_hash_map<uint64_t, Time> last_short;
  for (const ScenePtr& scene : scenes) {
    if (scene->spec().history.ticks == 0) continue;
    const SnapshotPtr snapshot = scene->latest();
    const auto known = last_short_.find(snapshot->epoch);
    if (forgets_early(snapshot->past_limit)) {
      if (known == last_short_.end()) log_short(*scene, *snapshot);
      last_short.emplace(snapshot->epoch, now);
    } else if (known != last_short_.end() && now - known->second < kEpisodeGap) {
      last_short.insert(*known);
    }
  }
  last_short_ = std::move(last_short);
}

}  // namespace locus::server
