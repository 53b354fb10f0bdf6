// What a server hosts: scenes by name, and meshes by name and by content. Scenes keep the meshes they use alive.
//
// Threads: every member may be called from any thread; none waits for a build or a writer. The registry's lock is taken
// before a scene's.
#ifndef LOCUS_CORE_SCENE_REGISTRY_H_
#define LOCUS_CORE_SCENE_REGISTRY_H_

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace locus {

using ScenePtr = std::shared_ptr<Scene>;
using MeshPtr = std::shared_ptr<const StaticMesh>;

// Scene names: ^[a-z]([a-z0-9-]{0,61}[a-z0-9])?$. INVALID_ARGUMENT naming `field` otherwise.
absl::Status check_scene_name(absl::string_view name, absl::string_view field);
// Mesh names: 1 to 63 printable characters without spaces.
absl::Status check_mesh_name(absl::string_view name, absl::string_view field);

class Registry {
 public:
  struct CreatedScene {
    ScenePtr scene;
    bool existed = false;
  };
  // ALREADY_EXISTS unless `if_absent`; NOT_FOUND when `static_from` (may be empty) does not exist.
  absl::StatusOr<CreatedScene> create_scene(const std::string& name, const SceneSpec& spec, uint64_t epoch,
                                            const std::string& static_from, bool if_absent) LOCUS_EXCLUDES(mutex_);
  absl::StatusOr<ScenePtr> find_scene(const std::string& name) const LOCUS_EXCLUDES(mutex_);
  // Closes and forgets it: waiters get NOT_FOUND.
  absl::Status delete_scene(const std::string& name) LOCUS_EXCLUDES(mutex_);
  // In name order, after `after` (exclusive), at most `limit`.
  std::vector<ScenePtr> list_scenes(const std::string& after, size_t limit) const LOCUS_EXCLUDES(mutex_);
  size_t scene_count() const LOCUS_EXCLUDES(mutex_);

  // The mesh of that content under whichever name, or null.
  MeshPtr find_content(const Sha256& sha256) const LOCUS_EXCLUDES(mutex_);
  absl::StatusOr<MeshPtr> find_mesh(const std::string& name, absl::string_view field) const LOCUS_EXCLUDES(mutex_);
  // Puts `mesh` under `name`, or the mesh of the same content that is there under any name, so that equal content is
  // held once; returns the one that counts. Other content under a known name is ALREADY_EXISTS.
  absl::StatusOr<MeshPtr> add_mesh(const std::string& name, MeshPtr mesh) LOCUS_EXCLUDES(mutex_);
  // FAILED_PRECONDITION IN_USE with the count while instances of any scene use it.
  absl::Status delete_mesh(const std::string& name) LOCUS_EXCLUDES(mutex_);
  struct NamedMesh {
    std::string name;
    MeshPtr mesh;
    uint32_t uses = 0;
  };
  std::vector<NamedMesh> list_meshes(const std::string& after, size_t limit) const LOCUS_EXCLUDES(mutex_);
  size_t mesh_count() const LOCUS_EXCLUDES(mutex_);
  // Instances of `mesh` in all scenes, under whichever of its names it was placed.
  uint32_t mesh_uses(const StaticMesh* mesh) const LOCUS_EXCLUDES(mutex_);

 private:
  uint32_t count_uses(const StaticMesh* mesh) const LOCUS_REQUIRES(mutex_);
  MeshPtr content(const Sha256& sha256) const LOCUS_REQUIRES(mutex_);

  mutable Mutex mutex_;
  std::map<std::string, ScenePtr> scenes_ LOCUS_GUARDED_BY(mutex_);
  std::map<std::string, MeshPtr> meshes_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_REGISTRY_H_
