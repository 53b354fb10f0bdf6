// Registry of a server: scenes by name, and meshes by name and by content. Scenes keep the meshes they use alive. With
// a log, a scene or mesh becomes visible after its creation is logged, and disappears after its deletion is logged.
//
// Threads: every member may be called from any thread. Members that change scenes are serialised and wait for the log,
// and so are members that change meshes, which may take seconds to write; delete_scene() also waits for a batch that is
// being applied, delete_mesh() for changes of both kinds; all others never wait. Lock order: mesh_changes_mutex_,
// changes_mutex_, the locks of a scene; mutex_ is held only for a lookup or an insertion, and is taken before a scene's
// reader lock.
#ifndef LOCUS_CORE_SCENE_REGISTRY_H_
#define LOCUS_CORE_SCENE_REGISTRY_H_

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/log/update_log.h"
#include "core/scene/scene.h"

namespace locus {

using ScenePtr = std::shared_ptr<Scene>;
using MeshPtr = std::shared_ptr<const StaticMesh>;

// Checks a scene name: ^[a-z]([a-z0-9-]{0,61}[a-z0-9])?$. INVALID_ARGUMENT naming `field` otherwise.
absl::Status check_scene_name(absl::string_view name, absl::string_view field);
// Checks a mesh name: 1 to 63 printable characters without spaces. INVALID_ARGUMENT naming `field` otherwise.
absl::Status check_mesh_name(absl::string_view name, absl::string_view field);

class Registry {
 public:
  // `log` may be null; otherwise it outlives the registry and its scenes. The registry outlives every change of its
  // scenes.
  explicit Registry(UpdateLog* log = nullptr) : log_(log) {}

  struct CreatedScene {
    ScenePtr scene;
    bool existed = false;
  };
  // Creates a scene, with the instances of the scene `static_from` unless that is empty. If the name is taken, returns
  // the existing scene with `if_absent` and ALREADY_EXISTS otherwise. NOT_FOUND if `static_from` does not exist;
  // DATA_LOSS if a damaged scene has one of the names; or the log's error.
  absl::StatusOr<CreatedScene> create_scene(const std::string& name, const SceneSpec& spec, uint64_t epoch,
                                            const std::string& static_from, bool if_absent)
      LOCUS_EXCLUDES(changes_mutex_, mutex_);
  // Returns the scene; NOT_FOUND, or DATA_LOSS for a damaged scene.
  absl::StatusOr<ScenePtr> find_scene(const std::string& name) const LOCUS_EXCLUDES(mutex_);
  // Closes and deletes a scene, damaged or not: its waiters get NOT_FOUND. After an error of the log the scene
  // continues.
  absl::Status delete_scene(const std::string& name) LOCUS_EXCLUDES(changes_mutex_, mutex_);
  // Returns at most `limit` scenes in name order, beginning after the name `after`.
  std::vector<ScenePtr> list_scenes(const std::string& after, size_t limit) const LOCUS_EXCLUDES(mutex_);
  struct Damaged {
    std::string name;
    absl::Status damage;
  };
  // Returns the damaged scenes in name order.
  std::vector<Damaged> damaged_scenes() const LOCUS_EXCLUDES(mutex_);
  size_t scene_count() const LOCUS_EXCLUDES(mutex_);

  // Returns the mesh of that content with the lowest name, or null.
  MeshPtr find_content(const Sha256& sha256) const LOCUS_EXCLUDES(mutex_);
  // Returns the mesh that has that name and that content, or null. Without a name as find_content().
  MeshPtr find_stored(const MeshKey& key) const LOCUS_EXCLUDES(mutex_);
  absl::StatusOr<MeshPtr> find_mesh(const std::string& name, absl::string_view field) const LOCUS_EXCLUDES(mutex_);
  // Adds `mesh` under `name` and returns the mesh that is registered: it shares the content of a mesh of equal content
  // if there is any, so that equal content is held once, and has its own parts. Returns a known name of equal content
  // and parts as it is. ALREADY_EXISTS if the name has other content or other parts.
  absl::StatusOr<MeshPtr> add_mesh(const std::string& name, MeshPtr mesh) LOCUS_EXCLUDES(mesh_changes_mutex_, mutex_);
  // Deletes a mesh. FAILED_PRECONDITION IN_USE, with the number of instances, while a scene uses it or a pending change
  // places it.
  absl::Status delete_mesh(const std::string& name) LOCUS_EXCLUDES(mesh_changes_mutex_, changes_mutex_, mutex_);
  struct NamedMesh {
    std::string name;
    MeshPtr mesh;
    uint32_t uses = 0;
  };
  std::vector<NamedMesh> list_meshes(const std::string& after, size_t limit) const LOCUS_EXCLUDES(mutex_);
  size_t mesh_count() const LOCUS_EXCLUDES(mutex_);
  // Returns the number of instances in all scenes that were placed under the name of `mesh`.
  uint32_t mesh_uses(const StaticMesh* mesh) const LOCUS_EXCLUDES(mutex_);

  // Add the scenes and meshes that were recovered from the log: see core/scene/recovery.h. Each name once; meshes
  // before scenes, because recover_scene() finds them by find_stored(). Equal content is held once.
  void restore_scene(const ScenePtr& scene) LOCUS_EXCLUDES(mutex_);
  void restore_mesh(const std::string& name, MeshPtr mesh) LOCUS_EXCLUDES(mutex_);
  // Add a damaged scene or mesh: lookups of its name return `damage` (DATA_LOSS) until it is deleted.
  void restore_damaged_scene(const std::string& name, SceneKey key, const absl::Status& damage) LOCUS_EXCLUDES(mutex_);
  void restore_damaged_mesh(const std::string& name, const absl::Status& damage) LOCUS_EXCLUDES(mutex_);

 private:
  struct DamagedScene {
    SceneKey key;
    absl::Status damage;
  };
  // Start of a new scene: its instances, or the scene that exists under the name.
  struct Beginning {
    ScenePtr existing;
    std::shared_ptr<const StaticSet> statics;
  };
  absl::StatusOr<Beginning> begin_scene(const std::string& name, const std::string& static_from, bool if_absent) const
      LOCUS_EXCLUDES(mutex_);
  absl::StatusOr<ScenePtr> log_scene(const std::string& name, const SceneSpec& spec, uint64_t epoch,
                                     std::shared_ptr<const StaticSet> statics) LOCUS_REQUIRES(changes_mutex_);
  void put_in(const ScenePtr& scene) LOCUS_EXCLUDES(mutex_);
  // Returns the key of the damaged scene of that name, or nullopt.
  std::optional<SceneKey> damaged_scene(const std::string& name) const LOCUS_EXCLUDES(mutex_);
  absl::Status delete_damaged_scene(const std::string& name, SceneKey key) LOCUS_REQUIRES(changes_mutex_)
      LOCUS_EXCLUDES(mutex_);
  // Returns the mesh that is registered under `name`, or null if `mesh` may be added. In that case `mesh` shares the
  // content of a registered mesh of equal content.
  absl::StatusOr<MeshPtr> begin_mesh(const std::string& name, MeshPtr& mesh) const LOCUS_EXCLUDES(mutex_);
  // Returns `mesh` under `name`; it shares the content of a registered mesh of equal content if there is any.
  MeshPtr to_keep(const std::string& name, MeshPtr mesh) const LOCUS_REQUIRES(mutex_);
  // Removes the name of a mesh, unless the mesh is in use, and returns the mesh; returns null for a damaged mesh, whose
  // name stays.
  absl::StatusOr<MeshPtr> take_mesh(const std::string& name) LOCUS_EXCLUDES(mutex_);
  bool is_kept(const StaticMesh* mesh) const LOCUS_EXCLUDES(mutex_);
  uint32_t count_uses(const StaticMesh* mesh) const LOCUS_REQUIRES(mutex_);
  MeshPtr content(const Sha256& sha256) const LOCUS_REQUIRES(mutex_);

  UpdateLog* const log_;
  Mutex mesh_changes_mutex_;  // serialises changes of meshes
  Mutex changes_mutex_;       // serialises changes of scenes and deletions of meshes
  mutable Mutex mutex_;
  std::map<std::string, ScenePtr> scenes_ LOCUS_GUARDED_BY(mutex_);
  std::map<std::string, DamagedScene> damaged_scenes_ LOCUS_GUARDED_BY(mutex_);
  std::map<std::string, MeshPtr> meshes_ LOCUS_GUARDED_BY(mutex_);
  std::map<std::string, absl::Status> damaged_meshes_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_REGISTRY_H_
