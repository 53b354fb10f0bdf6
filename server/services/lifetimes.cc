// Members of Host (server/host/host.h) for the lifetimes of scenes, meshes and leases: their start, and the reports of
// what no call has deleted.
#include <limits>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "server/host/host.h"
#include "server/observability/log.h"
#include "server/services/cluster/cluster_scenes.h"
#include "server/services/server_events.h"

namespace locus::server {

void Host::start_lifetimes() {
  for (const ScenePtr& scene : registry.list_scenes("", std::numeric_limits<size_t>::max())) {
    idle_scenes.watch(scene);
    leases.watch(scene);
  }
  if (cluster == nullptr) mesh_collector.start();
  lifetimes.start();
  lease_ends.start();
}

void Host::report_idle_scene(const ScenePtr& scene, const absl::Status& status) {
  const std::string& name = scene->name();
  report_deletion(*this, "DeleteScene", name, status, "no call has used the scene for its idle_ttl_s");
  if (!status.ok())
    return server::log(LogLevel::kWarning, "an idle scene could not be deleted; this is tried again",
                       {{"scene", name}, {"why", std::string(status.message())}});
  changes.forget(scene->latest()->epoch);
  leases.forget(*scene);
  if (cluster != nullptr) cluster->deleted(*scene);
  server::log(LogLevel::kInfo, "idle scene deleted", {{"scene", name}});
}

void Host::report_lease(const Scene& scene, uint64_t writer, const absl::StatusOr<uint64_t>& removed) {
  if (removed.ok()) report_lease_end(*this, scene.name(), *removed);
  const std::optional<uint64_t> left_out = lease_lines.admit(lease_ends.now());
  if (!left_out) return;
  const std::string id = absl::StrCat(writer), others = absl::StrCat(*left_out);
  if (!removed.ok())
    return server::log(LogLevel::kWarning, "the lease of a silent writer could not be ended; this is tried again",
                       {{"scene", scene.name()},
                        {"writer", id},
                        {"left_out", others},
                        {"why", std::string(removed.status().message())}});
  server::log(LogLevel::kInfo, "lease of a silent writer ended",
              {{"scene", scene.name()}, {"writer", id}, {"left_out", others}});
}

void Host::report_unused_mesh(const std::string& mesh, const absl::Status& status) {
  report_deletion(*this, "DeleteMesh", mesh, status, "no scene has used the mesh for its mesh_grace_s");
  if (!status.ok())
    return server::log(LogLevel::kWarning, "an unused mesh could not be deleted; this is tried again",
                       {{"mesh", mesh}, {"why", std::string(status.message())}});
  server::log(LogLevel::kInfo, "unused mesh deleted", {{"mesh", mesh}});
}

void Host::report_unmarked_meshes(const Scene& scene, const absl::Status& status) {
  server::log(LogLevel::kWarning,
              "meshes of a scene could not be marked for deletion after its mesh_grace_s; this is tried again at the "
              "next change of its instances",
              {{"scene", scene.name()}, {"why", std::string(status.message())}});
}

}  // namespace locus::server
