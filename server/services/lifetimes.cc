// Members of Host (server/host/host.h) for the lifetimes of scenes and meshes: their start, and the reports of
// deletions that no call has made.
#include <limits>
#include <string>

#include "server/host/host.h"
#include "server/observability/log.h"
#include "server/services/server_events.h"

namespace locus::server {

void Host::start_lifetimes() {
  for (const ScenePtr& scene : registry.list_scenes("", std::numeric_limits<size_t>::max())) idle_scenes.watch(scene);
  mesh_collector.start();
  lifetimes.start();
}

void Host::report_idle_scene(const ScenePtr& scene, const absl::Status& status) {
  const std::string& name = scene->name();
  report_deletion(*this, "DeleteScene", name, status, "no call has used the scene for its idle_ttl_s");
  if (!status.ok())
    return server::log(LogLevel::kWarning, "an idle scene could not be deleted; this is tried again",
                       {{"scene", name}, {"why", std::string(status.message())}});
  changes.forget(scene->latest()->epoch);
  server::log(LogLevel::kInfo, "idle scene deleted", {{"scene", name}});
}

void Host::report_unused_mesh(const std::string& mesh, const absl::Status& status) {
  report_deletion(*this, "DeleteMesh", mesh, status, "no scene has used the mesh for its mesh_grace_s");
  if (!status.ok())
    return server::log(LogLevel::kWarning, "an unused mesh could not be deleted or marked; this is tried again",
                       {{"mesh", mesh}, {"why", std::string(status.message())}});
  server::log(LogLevel::kInfo, "unused mesh deleted", {{"mesh", mesh}});
}

}  // namespace locus::server
