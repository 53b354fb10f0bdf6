// What a server hosts: scenes by name, and meshes by name and by content. Scenes keep the meshes they use alive. With a
// log, what is created is there once it is logged, and what is deleted is gone once that is.
//
// Threads: every member may be called from any thread. Those that change scenes are serialised and wait for the log,
// and so are those that change meshes, which may take seconds to be written; delete_scene() waits for a batch at work,
// too, delete_mesh() for changes of both kinds; all others wait for nothing. mesh_changes_mutex_ is taken before
// changes_mutex_, that before a scene's locks, mutex_ only to look something up or to put it in, before a scene's lock
// for readers.
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

// Scene names: ^[a-z]([a-z0-9-]{0,61}[a-z0-9])?$. INVALID_ARGUMENT naming `field` otherwise.
absl::Status check_scene_name(absl::string_view name, absl::string_view field);
// Mesh names: 1 to 63 printable characters without spaces.
absl::Status check_mesh_name(absl::string_view name, absl::string_view field);

class Registry {
 public:
  // `log`, where there is one, outlives the registry and its scenes. The registry outlives the changes of its scenes.
  explicit Registry(UpdateLog* log = nullptr) : log_(log) {}

  struct CreatedScene {
    ScenePtr scene;
    bool existed = false;
  };
  // ALREADY_EXISTS unless `if_absent`; NOT_FOUND when `static_from` (may be empty) does not exist; DATA_LOSS where a
  // damaged scene has the name; or the log's error.
  absl::StatusOr<CreatedScene> create_scene(const std::string& name, const SceneSpec& spec, uint64_t epoch,
                                            const std::string& static_from, bool if_absent)
      LOCUS_EXCLUDES(changes_mutex_, mutex_);
  // DATA_LOSS for one that is damaged.
  absl::StatusOr<ScenePtr> find_scene(const std::string& name) const LOCUS_EXCLUDES(mutex_);
  // Closes and forgets it, damaged or not: waiters get NOT_FOUND. After the log's error it goes on.
  absl::Status delete_scene(const std::string& name) LOCUS_EXCLUDES(changes_mutex_, mutex_);
  // In name order, after `after` (exclusive), at most `limit`.
  std::vector<ScenePtr> list_scenes(const std::string& after, size_t limit) const LOCUS_EXCLUDES(mutex_);
  // The damaged ones, in name order.
  struct Damaged {
    std::string name;
    absl::Status damage;
  };
  std::vector<Damaged> damaged_scenes() const LOCUS_EXCLUDES(mutex_);
  size_t scene_count() const LOCUS_EXCLUDES(mutex_);

  // Returns the mesh of that content with the lowest name, or null.
  MeshPtr find_content(const Sha256& sha256) const LOCUS_EXCLUDES(mutex_);
  // Returns the mesh that has that name and that content, or null. Without a name as find_content().
  MeshPtr find_stored(const MeshKey& key) const LOCUS_EXCLUDES(mutex_);
  absl::StatusOr<MeshPtr> find_mesh(const std::string& name, absl::string_view field) const LOCUS_EXCLUDES(mutex_);
  // Puts `mesh` under `name` and returns it as it is kept: sharing the content of a mesh of equal content that is there
  // under another name, so that equal content is held once. Each name keeps its own parts. A known name of equal
  // content and parts is returned as it is; other content or other parts under a known name are ALREADY_EXISTS.
  absl::StatusOr<MeshPtr> add_mesh(const std::string& name, MeshPtr mesh) LOCUS_EXCLUDES(mesh_changes_mutex_, mutex_);
  // FAILED_PRECONDITION IN_USE with the count while instances of any scene use it, or are about to.
  absl::Status delete_mesh(const std::string& name) LOCUS_EXCLUDES(mesh_changes_mutex_, changes_mutex_, mutex_);
  struct NamedMesh {
    std::string name;
    MeshPtr mesh;
    uint32_t uses = 0;
  };
  std::vector<NamedMesh> list_meshes(const std::string& after, size_t limit) const LOCUS_EXCLUDES(mutex_);
  size_t mesh_count() const LOCUS_EXCLUDES(mutex_);
  // Counts the instances in all scenes that were placed under the name of `mesh`.
  uint32_t mesh_uses(const StaticMesh* mesh) const LOCUS_EXCLUDES(mutex_);

  // What the log had when it was opened: see core/scene/recovery.h. Each name once; meshes first, so that scenes find
  // them by find_stored(). Equal content is held once.
  void restore_scene(const ScenePtr& scene) LOCUS_EXCLUDES(mutex_);
  void restore_mesh(const std::string& name, MeshPtr mesh) LOCUS_EXCLUDES(mutex_);
  // A scene or a mesh that cannot be believed: its name answers with `damage`, DATA_LOSS, until it is deleted.
  void restore_damaged_scene(const std::string& name, SceneKey key, const absl::Status& damage) LOCUS_EXCLUDES(mutex_);
  void restore_damaged_mesh(const std::string& name, const absl::Status& damage) LOCUS_EXCLUDES(mutex_);

 private:
  struct DamagedScene {
    SceneKey key;
    absl::Status damage;
  };
  // What a new scene begins with, or why there can be none; the scene that is there already.
  struct Beginning {
    ScenePtr existing;
    std::shared_ptr<const StaticSet> statics;
  };
  absl::StatusOr<Beginning> begin_scene(const std::string& name, const std::string& static_from, bool if_absent) const
      LOCUS_EXCLUDES(mutex_);
  absl::StatusOr<ScenePtr> log_scene(const std::string& name, const SceneSpec& spec, uint64_t epoch,
                                     std::shared_ptr<const StaticSet> statics) LOCUS_REQUIRES(changes_mutex_);
  void put_in(const ScenePtr& scene) LOCUS_EXCLUDES(mutex_);
  // The damaged scene's key, where there is one of that name.
  std::optional<SceneKey> damaged_scene(const std::string& name) const LOCUS_EXCLUDES(mutex_);
  absl::Status delete_damaged_scene(const std::string& name, SceneKey key) LOCUS_REQUIRES(changes_mutex_)
      LOCUS_EXCLUDES(mutex_);
  // Returns the mesh that is under `name` already. Where there is none, returns null and makes `mesh` what is to be
  // kept.
  absl::StatusOr<MeshPtr> begin_mesh(const std::string& name, MeshPtr& mesh) const LOCUS_EXCLUDES(mutex_);
  // Returns `mesh` under `name`, sharing the content of a mesh that is kept where there is one.
  MeshPtr to_keep(const std::string& name, MeshPtr mesh) const LOCUS_REQUIRES(mutex_);
  // The mesh's name is gone; what was there, null for one that is damaged.
  absl::StatusOr<MeshPtr> take_mesh(const std::string& name) LOCUS_EXCLUDES(mutex_);
  bool is_kept(const StaticMesh* mesh) const LOCUS_EXCLUDES(mutex_);
  uint32_t count_uses(const StaticMesh* mesh) const LOCUS_REQUIRES(mutex_);
  MeshPtr content(const Sha256& sha256) const LOCUS_REQUIRES(mutex_);

  UpdateLog* const log_;
  Mutex mesh_changes_mutex_;  // one change of meshes at a time
  Mutex changes_mutex_;       // one change of scenes at a time, while no mesh is deleted
  mutable Mutex mutex_;
  std::map<std::string, ScenePtr> scenes_ LOCUS_GUARDED_BY(mutex_);
  std::map<std::string, DamagedScene> damaged_scenes_ LOCUS_GUARDED_BY(mutex_);
  std::map<std::string, MeshPtr> meshes_ LOCUS_GUARDED_BY(mutex_);
  std::map<std::string, absl::Status> damaged_meshes_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_REGISTRY_H_
