// Choice of the member that leads a scene: the less loaded of two that are drawn at random from the members. Two random
// choices keep the largest load near the mean although each daemon decides by a table that is seconds old
// (Mitzenmacher, The Power of Two Choices in Randomized Load Balancing, 2001); the least loaded of all would be chosen
// by all at once.
//
// Threads: one thread at a time. Invariant: the table contains living members only that take scenes, in any order.
#ifndef LOCUS_SERVER_CLUSTER_PLACEMENT_H_
#define LOCUS_SERVER_CLUSTER_PLACEMENT_H_

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "absl/types/span.h"
#include "server/cluster/cluster_engine.h"
#include "server/cluster/cluster_timing.h"

namespace locus::server {

// Function that returns 64 random bits.
using RandomBits = std::function<uint64_t()>;

class PlacementTable {
 public:
  // Replaces the table, which was read at `now`.
  void update(absl::Span<const MemberRow> members, ClusterTime now);
  // Returns true if the table was read `age` before `now` or later.
  bool fresh(ClusterTime now, ClusterTiming::Duration age) const { return read_ && now - *read_ <= age; }
  // Makes the next fresh() return false.
  void expire() { read_.reset(); }
  // Removes a member that does not live or does not take scenes.
  void remove(MemberId id);

  // Returns the less loaded of two random members other than `excluded`, or nullopt if there is none. The later choices
  // until the next update() count `load` for the member, and prefer members that were chosen less often if loads are
  // equal. `excluded` may be 0. Cost: constant, or the size of the table if a member is excluded.
  std::optional<MemberId> choose(const RandomBits& random, MemberId excluded, uint64_t load);
  // Returns the least loaded member of `from`, or nullopt if none of them is in the table. Cost: size of the table.
  std::optional<MemberId> choose_of(absl::Span<const MemberId> from);

 private:
  struct Candidate {
    MemberId id = 0;
    uint64_t load = 0;
    uint64_t chosen = 0;  // number of times since update()
  };
  static bool less_loaded(const Candidate& a, const Candidate& b);
  static MemberId count(Candidate& candidate, uint64_t load);

  std::vector<Candidate> table_;
  std::optional<ClusterTime> read_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CLUSTER_PLACEMENT_H_
