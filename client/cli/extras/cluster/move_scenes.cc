#include "client/cli/extras/cluster/move_scenes.h"

#include <cstddef>
#include <map>

#include "absl/status/statusor.h"

namespace locus::cli {

std::vector<MemberLoad> read_loads(ClusterConnections& connections, const std::vector<LedScene>& scenes,
                                   const std::vector<std::string>& addresses, MemoryScenes memory,
                                   ProgressWriter& progress) {
  std::vector<MemberLoad> loads;
  std::map<std::string, size_t> index;
  for (const std::string& address : addresses) {
    index[address] = loads.size();
    loads.push_back({address});
  }
  progress.begin({.action = "reading loads", .unit = "scenes", .total = scenes.size()});
  uint64_t done = 0;
  for (const LedScene& scene : scenes) {
    progress.update(++done);
    const auto leader = index.find(scene.leader);
    if (leader == index.end()) continue;
    MemberLoad& member = loads[leader->second];
    const absl::StatusOr<client::Client*> client = connections.at(scene.leader);
    const absl::StatusOr<v1::Scene> described =
        client.ok() ? (*client)->get_scene(scene.name) : absl::StatusOr<v1::Scene>(client.status());
    const uint64_t load = kSceneLoad + (described.ok() ? described->objects() : 0);
    if (described.ok() && (!scene.in_memory || memory == MemoryScenes::kMove))
      member.scenes.push_back({scene.name, load});
    else
      member.fixed += load;
  }
  return loads;
}

void make_moves(ClusterConnections& connections, const std::vector<PlannedMove>& moves, ProgressWriter& progress,
                const std::function<void(const PlannedMove&, const absl::Status&)>& on_moved) {
  progress.begin({.action = "moving", .unit = "scenes", .total = moves.size()});
  uint64_t done = 0;
  for (const PlannedMove& move : moves) {
    const absl::Status status = connections.move_from(move.from, move.scene, move.to).status();
    progress.hide();
    on_moved(move, status);
    progress.show();
    progress.update(++done);
  }
}

}  // namespace locus::cli
