// The parts that `locus cluster drain` and `locus cluster rebalance` share: reading the loads of scenes, and making
// planned moves. Functions without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_CLUSTER_MOVE_SCENES_H_
#define LOCUS_CLIENT_CLI_EXTRAS_CLUSTER_MOVE_SCENES_H_

#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/cli/extras/cluster/cluster_connections.h"
#include "client/cli/extras/cluster/cluster_facts.h"
#include "client/cli/extras/cluster/rebalance.h"
#include "core/base/progress_writer.h"

namespace locus::cli {

// Reads the scenes of the members at `addresses` from these members, in the order of `addresses`. A scene that its
// leader does not describe, because it is being moved or read, counts as a small scene that stays. Scenes of durability
// memory stay if `memory` is kStay.
std::vector<MemberLoad> read_loads(ClusterConnections& connections, const std::vector<LedScene>& scenes,
                                   const std::vector<std::string>& addresses, MemoryScenes memory,
                                   ProgressWriter& progress);

// Makes the moves one after another, and passes the outcome of each to `on_moved`.
void make_moves(ClusterConnections& connections, const std::vector<PlannedMove>& moves, ProgressWriter& progress,
                const std::function<void(const PlannedMove&, const absl::Status&)>& on_moved);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_CLUSTER_MOVE_SCENES_H_
