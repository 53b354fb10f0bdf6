#include "client/cli/extras/cluster/rebalance.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "core/base/check.h"

namespace locus::cli {
namespace {

using Loads = std::vector<uint64_t>;

Loads loads_of(const std::vector<MemberLoad>& members) {
  Loads loads;
  for (const MemberLoad& member : members) loads.push_back(load_of(member));
  return loads;
}

// Returns the index of the first largest load, or of the first smallest one.
size_t busiest_of(const Loads& loads) {
  return static_cast<size_t>(std::max_element(loads.begin(), loads.end()) - loads.begin());
}
size_t least_of(const Loads& loads) {
  return static_cast<size_t>(std::min_element(loads.begin(), loads.end()) - loads.begin());
}

}  // namespace

uint64_t load_of(const MemberLoad& member) {
  uint64_t load = member.fixed;
  for (const SceneLoad& scene : member.scenes) load += scene.load;
  return load;
}

RebalancePlan plan_rebalance(std::vector<MemberLoad> members) {
  RebalancePlan plan;
  if (members.empty()) return plan;
  Loads loads = loads_of(members);
  uint64_t sum = 0;
  for (const uint64_t load : loads) sum += load;
  plan.mean = static_cast<double>(sum) / static_cast<double>(loads.size());
  plan.busiest_before = loads[busiest_of(loads)];
  while (true) {
    const size_t from = busiest_of(loads), to = least_of(loads);
    plan.busiest_after = loads[from];
    if (static_cast<double>(loads[from]) <= kBalancedShare * plan.mean) return plan;
    std::vector<SceneLoad>& scenes = members[from].scenes;
    const auto larger_after = [&](const SceneLoad& scene) {
      return std::max(loads[from] - scene.load, loads[to] + scene.load);
    };
    const auto best = std::min_element(scenes.begin(), scenes.end(), [&](const SceneLoad& a, const SceneLoad& b) {
      return larger_after(a) < larger_after(b);
    });
    if (best == scenes.end() || larger_after(*best) >= loads[from]) return plan;
    plan.moves.push_back({best->name, members[from].address, members[to].address, best->load});
    loads[from] -= best->load;
    loads[to] += best->load;
    members[to].scenes.push_back(std::move(*best));
    scenes.erase(best);
  }
}

std::vector<PlannedMove> plan_drain(const MemberLoad& source, std::vector<MemberLoad> others) {
  LOCUS_CHECK(!others.empty());
  Loads loads = loads_of(others);
  std::vector<PlannedMove> moves;
  for (const SceneLoad& scene : source.scenes) {
    const size_t to = least_of(loads);
    moves.push_back({scene.name, source.address, others[to].address, scene.load});
    loads[to] += scene.load;
  }
  return moves;
}

}  // namespace locus::cli
