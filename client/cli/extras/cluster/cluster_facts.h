// Facts about a cluster as one of its servers tells them: members, engine, and which member leads which scene. Plain
// data and functions without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_CLUSTER_CLUSTER_FACTS_H_
#define LOCUS_CLIENT_CLI_EXTRAS_CLUSTER_CLUSTER_FACTS_H_

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/cli/output.h"
#include "client/lib/client.h"

namespace locus::cli {

// One scene of a cluster.
struct LedScene {
  std::string name;
  std::string leader;      // address; empty: no member leads the scene at present
  bool in_memory = false;  // durability memory: a new leader begins with an empty scene
};

// Choice for scenes of durability memory, which lose their objects when they move.
enum class MemoryScenes { kStay, kMove };

// Returns the description of the server's cluster. Returns FAILED_PRECONDITION if the server belongs to no cluster.
absl::StatusOr<v1::Cluster> read_cluster(const client::Client& client);

// Returns the member of this address. Returns NOT_FOUND, naming all members, if there is none.
absl::StatusOr<v1::ClusterMember> find_member(const v1::Cluster& cluster, absl::string_view address);

// Returns all scenes of the server's cluster, ascending by name. Errors: those of Client::list_scenes().
absl::StatusOr<std::vector<LedScene>> read_led_scenes(const client::Client& client);

// Returns the number of scenes that each address leads; the entry "" counts the scenes without a leader.
std::map<std::string, uint64_t> count_by_leader(const std::vector<LedScene>& scenes);

// Returns the lines `SCENE ADDRESS` of a map for a proxy, in the order of `scenes`, without scenes that have no leader.
std::string map_lines(const std::vector<LedScene>& scenes);

// Returns the report of `locus cluster status`. `scenes` is null if they are not known. A server tells the engine's
// hosts only to callers who may see its metrics.
Report report_of(const v1::Cluster& cluster, const std::vector<LedScene>* scenes);

// Returns the role of the server that answered, such as "leading".
std::string role_name(v1::SceneRole role);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_CLUSTER_CLUSTER_FACTS_H_
