// Neighbours of a member on the ring of members, and the dead members for whose scenes it is responsible: those between
// it and the next living member. So each dead member has exactly one responsible member, once all have noticed the
// death; if the responsible one dies too, the living member before it becomes responsible for both.
//
// Threads: one thread at a time.
#ifndef LOCUS_SERVER_CLUSTER_RING_H_
#define LOCUS_SERVER_CLUSTER_RING_H_

#include <optional>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/flat_hash_set.h"
#include "absl/types/span.h"
#include "server/cluster/cluster_engine.h"
#include "server/cluster/cluster_timing.h"

namespace locus::server {

// Returns true if `id` is between `from` and `to` on the ring. Both ends are excluded. If `from` equals `to`, all other
// ids are between them.
constexpr bool between(MemberId from, MemberId id, MemberId to) {
  return from < to ? from < id && id < to : id != from && id != to && (from < id || id < to);
}

class Ring {
 public:
  Ring() = default;

  // Stores the answer to a beat that was sent at `sent` and received at `received`.
  void update(const BeatReply& reply, ClusterTime sent, ClusterTime received);
  // Records at `now` that a member is dead.
  void add_dead(MemberId id, ClusterTime now);
  // Records that a dead member leads no scene any more.
  void remove_dead(MemberId id) { dead_.erase(id); }

  bool is_dead(MemberId id) const { return dead_.contains(id); }
  // Returns the next living member after `self`, or `self` if there is no other one.
  MemberId next_living(MemberId self) const;
  // Returns true if `self` is the living member with the largest id, so that exactly one member is.
  bool is_last(MemberId self) const { return next_living(self) <= self; }
  // Returns the dead members that were noticed since the last call.
  std::vector<MemberId> take_noticed();
  // Returns a dead member for which `self` is responsible and that was noticed at `noticed_by` or before, the first
  // noticed of them first, or nullopt.
  std::optional<MemberId> responsibility(MemberId self, ClusterTime noticed_by) const;
  // Returns the time at which the first dead member for which `self` is responsible was noticed, or max().
  ClusterTime first_noticed(MemberId self) const;

 private:
  absl::btree_map<MemberId, ClusterTime> dead_;  // with the time of notice
  std::vector<MemberId> noticed_;
  std::vector<MemberId> next_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CLUSTER_RING_H_
