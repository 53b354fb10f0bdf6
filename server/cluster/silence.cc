#include "server/cluster/silence.h"

#include <algorithm>
#include <utility>

#include "core/base/planted_bug.h"

namespace locus::server {

void SilenceCounter::beat_succeeded(ClusterTime received, absl::Span<const SeenBeat> seen) {
  if (stale(received) && !planted(PlantedBug::kSilenceWithoutBeats)) watched_.clear();
  last_success_ = received;
  absl::flat_hash_map<MemberId, Watched> now_watched;
  for (const SeenBeat& member : seen) {
    const auto known = watched_.find(member.id);
    const bool same = known != watched_.end() && known->second.beat == member.beat;
    now_watched.emplace(member.id, same ? known->second : Watched{member.beat, received});
  }
  watched_ = std::move(now_watched);
}

void SilenceCounter::beat_failed() {
  if (planted(PlantedBug::kSilenceWithoutBeats)) return;
  clear();
}

void SilenceCounter::restart(MemberId id, ClusterTime now) {
  if (const auto known = watched_.find(id); known != watched_.end()) known->second.since = now;
}

void SilenceCounter::clear() {
  watched_.clear();
  last_success_.reset();
}

std::optional<SeenBeat> SilenceCounter::silent(ClusterTime now) const {
  if (stale(now) && !planted(PlantedBug::kSilenceWithoutBeats)) return std::nullopt;
  for (const auto& [id, watched] : watched_)
    if (now - watched.since >= timing_.silence) return SeenBeat{id, watched.beat};
  return std::nullopt;
}

ClusterTime SilenceCounter::next(ClusterTime now) const {
  if (stale(now)) return ClusterTime::max();
  ClusterTime first = ClusterTime::max();
  for (const auto& [id, watched] : watched_) first = std::min(first, watched.since + timing_.silence);
  return first;
}

size_t SilenceCounter::quiet(ClusterTime now) const {
  return static_cast<size_t>(std::count_if(watched_.begin(), watched_.end(), [&](const auto& member) {
    return now - member.second.since >= timing_.quiet;
  }));
}

}  // namespace locus::server
