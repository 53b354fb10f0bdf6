#include "server/cluster/ring.h"

#include <algorithm>
#include <utility>

namespace locus::server {

void Ring::update(const BeatReply& reply, ClusterTime sent, ClusterTime received) {
  next_.clear();
  for (const SeenBeat& member : reply.next) next_.push_back(member.id);
  // A member that was noticed after the beat was sent may be dead although the answer does not name it.
  const absl::flat_hash_set<MemberId> named(reply.dead.begin(), reply.dead.end());
  absl::erase_if(dead_, [&](const auto& dead) { return dead.second < sent && !named.contains(dead.first); });
  for (const MemberId id : reply.dead) add_dead(id, received);
}

void Ring::add_dead(MemberId id, ClusterTime now) {
  if (dead_.try_emplace(id, now).second) noticed_.push_back(id);
}

MemberId Ring::next_living(MemberId self) const {
  const auto living = std::find_if(next_.begin(), next_.end(), [&](MemberId id) { return !is_dead(id); });
  return living == next_.end() ? self : *living;
}

std::vector<MemberId> Ring::take_noticed() { return std::exchange(noticed_, {}); }

std::optional<MemberId> Ring::responsibility(MemberId self, ClusterTime noticed_by) const {
  const MemberId next = next_living(self);
  std::optional<MemberId> found;
  ClusterTime first = ClusterTime::max();
  for (const auto& [id, noticed] : dead_) {
    if (noticed > noticed_by || noticed >= first || !between(self, id, next)) continue;
    found = id;
    first = noticed;
  }
  return found;
}

ClusterTime Ring::first_noticed(MemberId self) const {
  const MemberId next = next_living(self);
  ClusterTime first = ClusterTime::max();
  for (const auto& [id, noticed] : dead_)
    if (between(self, id, next)) first = std::min(first, noticed);
  return first;
}

}  // namespace locus::server
