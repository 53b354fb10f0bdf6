// Meshes in a cluster: the engine has all of them, and a daemon reads a mesh when a scene or a caller needs it. Before
// a scene places a mesh, its leader claims the mesh in the engine, so that no member deletes it.
//
// Threads: any thread may call the functions, which wait for the engine and, where a tree is built, for that.
#ifndef LOCUS_SERVER_SERVICES_CLUSTER_CLUSTER_MESHES_H_
#define LOCUS_SERVER_SERVICES_CLUSTER_CLUSTER_MESHES_H_

#include <string>

#include "absl/status/statusor.h"
#include "core/base/mutex.h"
#include "core/scene/registry.h"
#include "server/host/host.h"
#include "server/storage/postgres_log.h"

namespace locus::server {

class ClusterMeshes {
 public:
  // `host` and `log` must outlive this object.
  ClusterMeshes(Host& host, PostgresLog& log) : host_(host), log_(log) {}

  // Makes the registry's mesh of this name that of the engine: reads it, or forgets it if the engine has none. Returns
  // NOT_FOUND, naming `field`, if there is none, and the engine's error if it does not answer.
  absl::StatusOr<MeshPtr> refresh(const std::string& name, absl::string_view field) LOCUS_EXCLUDES(mutex_);
  // Forgets the registry's mesh of this name if the engine has none or one of other content, without reading it.
  absl::Status forget_stale(const std::string& name) LOCUS_EXCLUDES(mutex_);
  // Claims the meshes that a change of a scene that this daemon leads places. The meshes must count as in use by the
  // scene (Scene::ExpectedMeshes). Errors: NOT_FOUND if a mesh was deleted meanwhile; NO_LEADER if another member leads
  // the scene; the engine's error if it does not answer.
  absl::Status claim(const Scene& scene, const StaticChange& change) LOCUS_EXCLUDES(claims_mutex_);
  // Tells the engine which meshes the scene uses, after a change that removed instances or failed. Does nothing for a
  // scene that this daemon does not lead any more. Logs an error: then meshes stay claimed until the next change or the
  // next leader.
  void release_unused(const Scene& scene) LOCUS_EXCLUDES(claims_mutex_);
  // Returns the page of the cluster's meshes after `after`.
  absl::StatusOr<std::vector<StoredMesh>> list(const std::string& after, size_t limit) const {
    return log_.list_stored_meshes(after, limit);
  }

 private:
  Host& host_;
  PostgresLog& log_;
  Mutex mutex_;         // serialises refresh()
  Mutex claims_mutex_;  // held while uses are counted and sent, so that a claim is not overwritten by an older count
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_CLUSTER_CLUSTER_MESHES_H_
