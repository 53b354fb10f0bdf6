#include "client/cli/extras/cluster/cluster_facts.h"

#include <algorithm>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/base/status_macros.h"

namespace locus::cli {

absl::StatusOr<v1::Cluster> read_cluster(const client::Client& client) {
  ASSIGN_OR_RETURN(v1::GetServerResponse server, client.get_server());
  if (!server.has_cluster())
    return absl::FailedPreconditionError(
        absl::StrCat("the server at ", client.address(), " belongs to no cluster: it was started without --cluster"));
  return std::move(*server.mutable_cluster());
}

absl::StatusOr<v1::ClusterMember> find_member(const v1::Cluster& cluster, absl::string_view address) {
  std::string others;
  for (const v1::ClusterMember& member : cluster.members()) {
    if (member.address() == address) return member;
    absl::StrAppend(&others, others.empty() ? "" : ", ", member.address());
  }
  return absl::NotFoundError(
      absl::StrCat("no member of the cluster has the address ", address, "; its members are ", others));
}

absl::StatusOr<std::vector<LedScene>> read_led_scenes(const client::Client& client) {
  ASSIGN_OR_RETURN(const std::vector<v1::Scene> scenes, client.list_scenes());
  std::vector<LedScene> led;
  led.reserve(scenes.size());
  for (const v1::Scene& scene : scenes) {
    const bool has_leader = scene.placement().role() != v1::SCENE_ROLE_NO_LEADER;
    led.push_back({scene.name(), has_leader ? scene.placement().leader() : "",
                   scene.spec().durability() == v1::DURABILITY_MEMORY});
  }
  std::sort(led.begin(), led.end(), [](const LedScene& a, const LedScene& b) { return a.name < b.name; });
  return led;
}

std::map<std::string, uint64_t> count_by_leader(const std::vector<LedScene>& scenes) {
  std::map<std::string, uint64_t> counts;
  for (const LedScene& scene : scenes) ++counts[scene.leader];
  return counts;
}

std::string map_lines(const std::vector<LedScene>& scenes) {
  std::string lines;
  for (const LedScene& scene : scenes)
    if (!scene.leader.empty()) absl::StrAppend(&lines, scene.name, " ", scene.leader, "\n");
  return lines;
}

Report report_of(const v1::Cluster& cluster, const std::vector<LedScene>* scenes) {
  std::map<std::string, uint64_t> counts;
  if (scenes != nullptr) counts = count_by_leader(*scenes);
  Report report;
  report.rows_name = "members";
  report.no_rows = "no members";
  report.keys = {"address", "zone", "version", "load", "draining", "scenes", "this"};
  for (const v1::ClusterMember& member : cluster.members())
    report.rows.push_back({{"address", member.address()},
                           {"zone", member.zone().empty() ? Json() : Json(member.zone())},
                           {"version", member.version()},
                           {"load", member.draining() ? Json() : Json(member.load())},
                           {"draining", member.draining()},
                           {"scenes", scenes == nullptr ? Json() : Json(counts[member.address()])},
                           {"this", member.id() == cluster.member()}});
  report.head = {{"engine", cluster.engine().empty() ? Json() : Json(cluster.engine())},
                 {"engine_answers", cluster.engine_answers()},
                 {"scenes", scenes == nullptr ? Json() : Json(scenes->size())},
                 {"no_leader", scenes == nullptr ? Json() : Json(counts[""])}};
  return report;
}

std::string role_name(v1::SceneRole role) {
  return absl::AsciiStrToLower(absl::StripPrefix(v1::SceneRole_Name(role), "SCENE_ROLE_"));
}

}  // namespace locus::cli
