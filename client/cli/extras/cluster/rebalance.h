// Plans which scenes to move between the members of a cluster so that no member has much more load than the others.
// Plain data and functions without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_CLUSTER_REBALANCE_H_
#define LOCUS_CLIENT_CLI_EXTRAS_CLUSTER_REBALANCE_H_

#include <cstdint>
#include <string>
#include <vector>

namespace locus::cli {

// Load of a scene itself, in objects. The server counts the load of its scenes in the same way.
inline constexpr uint64_t kSceneLoad = 1'000;
// Share of the mean load up to which the busiest member counts as balanced.
inline constexpr double kBalancedShare = 1.2;

struct SceneLoad {
  std::string name;
  uint64_t load = 0;
};

// One member with the scenes that it leads. `fixed` is the load of the scenes that must stay.
struct MemberLoad {
  std::string address;
  std::vector<SceneLoad> scenes = {};
  uint64_t fixed = 0;
};

struct PlannedMove {
  std::string scene;
  std::string from;
  std::string to;
  uint64_t load = 0;
};

struct RebalancePlan {
  std::vector<PlannedMove> moves;
  double mean = 0;
  uint64_t busiest_before = 0;
  uint64_t busiest_after = 0;
};

// Returns the load of a member.
uint64_t load_of(const MemberLoad& member);

// Plans moves from the busiest member to the least loaded one until the busiest has at most kBalancedShare of the mean,
// or no scene of the busiest lowers the largest load of the two. Each move is the scene that lowers it most. Members of
// equal load are taken in the order of `members`, so equal inputs give equal plans. Cost: moves times (members and
// scenes of one member).
RebalancePlan plan_rebalance(std::vector<MemberLoad> members);

// Plans to move all scenes of `source` away, each to the member that is then the least loaded. Precondition: `others`
// is not empty.
std::vector<PlannedMove> plan_drain(const MemberLoad& source, std::vector<MemberLoad> others);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_CLUSTER_REBALANCE_H_
