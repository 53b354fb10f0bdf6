// Registry of a server: scenes by name, and meshes by name and by content hash. A scene shares the ownership of the
// meshes that it uses. With a log, a scene or mesh becomes visible once its creation is logged. A scene stays visible
// until its deletion is logged; a mesh is hidden before its deletion is logged, and is visible again if the log fails.
//
// Threads: every member may be called from any thread. Changes of scenes run one at a time and wait for the log.
// Changes of meshes run one at a time as well; a change that writes a mesh may take seconds. delete_scene() also waits
// for a batch that is being applied. delete_mesh() waits for running changes of scenes and of meshes. All other members
// never wait. Lock order: mesh_changes_mutex_, changes_mutex_, then the locks of a scene. mutex_ is held only for a
// lookup or an insertion; while it is held, only Scene::mutex_ may be locked.
#ifndef LOCUS_CORE_SCENE_REGISTRY_H_
#define LOCUS_CORE_SCENE_REGISTRY_H_

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/container/flat_hash_set.h"
#include "absl/functional/function_ref.h"
#include "absl/types/span.h"
#include "core/scene/log/update_log.h"
#include "core/scene/scene.h"

namespace locus {

using ScenePtr = std::shared_ptr<Scene>;
using MeshPtr = std::shared_ptr<const StaticMesh>;

// Sums over the scenes and meshes of one creator.
struct CreatorUse {
  uint64_t scenes = 0;
  uint64_t objects = 0;        // objects in the latest revisions
  uint64_t history_bytes = 0;  // sum of HistoryOptions::bytes, the maximum memory of the histories
  uint64_t mesh_bytes = 0;     // sum of StaticMesh::bytes(); shared content counts once for each name
};

class Registry {
 public:
  // `log` may be null; otherwise the log outlives the registry and its scenes. The registry outlives every call of
  // Scene::change_instances() of its scenes: with a log, these calls check with the registry that a mesh is still
  // registered.
  explicit Registry(UpdateLog* log = nullptr) : log_(log) {}

  struct CreatedScene {
    ScenePtr scene;
    bool existed = false;
  };
  // Creates a scene. The scene begins with the instances of the scene `static_from`, or without instances if
  // `static_from` is empty. If the name is taken, returns the existing scene if `if_absent` is true, else
  // ALREADY_EXISTS. Returns INVALID_ARGUMENT if `name` is not a valid name, RESOURCE_EXHAUSTED if there are
  // limits::kMaxScenes scenes, NOT_FOUND if `static_from` does not exist, DATA_LOSS if `name` or `static_from` names a
  // damaged scene, and the log's error if the log fails.
  absl::StatusOr<CreatedScene> create_scene(const std::string& name, const SceneSpec& spec, uint64_t epoch,
                                            const std::string& static_from, bool if_absent)
      LOCUS_EXCLUDES(changes_mutex_, mutex_);
  // Returns the error that create_scene() returns if no scene has the name `static_from`.
  static absl::Status no_source(const std::string& static_from);
  // Returns the scene of this name, NOT_FOUND if no scene has the name, or DATA_LOSS if the scene is damaged.
  absl::StatusOr<ScenePtr> find_scene(const std::string& name) const LOCUS_EXCLUDES(mutex_);
  // Deletes a scene, damaged or not, and closes it: callers that wait for the scene get NOT_FOUND. If the log fails,
  // returns the log's error, and the scene stays open.
  absl::Status delete_scene(const std::string& name) LOCUS_EXCLUDES(changes_mutex_, mutex_);
  // Deletes `scene` like delete_scene() if it is still registered and `condition` returns true. `condition` is called
  // while no change of the scene is being applied. Returns whether the scene was deleted, or the log's error.
  absl::StatusOr<bool> delete_scene_if(const ScenePtr& scene, absl::FunctionRef<bool()> condition)
      LOCUS_EXCLUDES(changes_mutex_, mutex_);
  // Returns at most `limit` scenes in name order, beginning after the name `after`.
  std::vector<ScenePtr> list_scenes(const std::string& after, size_t limit) const LOCUS_EXCLUDES(mutex_);
  struct Damaged {
    std::string name;
    absl::Status damage;
  };
  // Returns the damaged scenes in name order.
  std::vector<Damaged> damaged_scenes() const LOCUS_EXCLUDES(mutex_);
  size_t scene_count() const LOCUS_EXCLUDES(mutex_);

  // Returns a mesh whose content has this hash, or null. If several names have this content, returns the mesh of the
  // name that sorts first.
  MeshPtr find_content(const Sha256& sha256) const LOCUS_EXCLUDES(mutex_);
  // Returns the mesh that is registered under key.name if its content has the hash key.sha256, else null. If key.name
  // is empty, because the key was stored in data format 1, returns find_content(key.sha256).
  MeshPtr find_stored(const MeshKey& key) const LOCUS_EXCLUDES(mutex_);
  // Returns the mesh of this name, NOT_FOUND naming `field` if no mesh has the name, or DATA_LOSS if the mesh is
  // damaged.
  absl::StatusOr<MeshPtr> find_mesh(const std::string& name, absl::string_view field) const LOCUS_EXCLUDES(mutex_);
  // Adds `mesh` under `name` and returns the registered mesh, which has this name and the parts of `mesh`. If a
  // registered mesh has equal content, both meshes share the content, so that equal content is in memory once. If the
  // name is registered with equal content and equal parts, returns the registered mesh. Returns ALREADY_EXISTS if the
  // name is registered with other content or other parts, INVALID_ARGUMENT if `name` is not a valid name,
  // RESOURCE_EXHAUSTED if there are limits::kMaxMeshes meshes, DATA_LOSS if `name` names a damaged mesh, and the log's
  // error if the log fails.
  absl::StatusOr<MeshPtr> add_mesh(const std::string& name, MeshPtr mesh) LOCUS_EXCLUDES(mesh_changes_mutex_, mutex_);
  // Deletes a mesh, damaged or not. Returns FAILED_PRECONDITION IN_USE, naming the number of its instances, if a scene
  // has instances that were placed under this name, or if a pending change places such instances.
  absl::Status delete_mesh(const std::string& name) LOCUS_EXCLUDES(mesh_changes_mutex_, changes_mutex_, mutex_);
  // Records that each of `meshes` may be deleted when no scene has used it for `grace_s` seconds. If this was recorded
  // before, the longer time applies. With a log, the records survive a restart, and are written at once. Ignores meshes
  // that are not registered any more. Returns the log's error if the log fails; then nothing has changed.
  absl::Status make_collectable(absl::Span<const StaticMesh* const> meshes, uint32_t grace_s)
      LOCUS_EXCLUDES(mesh_changes_mutex_, mutex_);
  struct CollectableMesh {
    MeshPtr mesh;
    uint32_t grace_s = 0;
  };
  // Returns the meshes for which make_collectable() was called, in name order.
  std::vector<CollectableMesh> collectable_meshes() const LOCUS_EXCLUDES(mutex_);
  // Returns the meshes that the latest revision, the history or a pending change of a scene uses.
  absl::flat_hash_set<const StaticMesh*> used_meshes() const LOCUS_EXCLUDES(mutex_);
  // Deletes `mesh` like delete_mesh() if it is still registered, no latest revision and no pending change uses it, and
  // `condition` returns true. From the call of `condition` on, no other call finds the mesh. `condition` is called
  // under a lock of the registry: it must be quick and must not call the registry. Returns whether the mesh was
  // deleted, or the log's error.
  absl::StatusOr<bool> delete_mesh_if(const MeshPtr& mesh, absl::FunctionRef<bool()> condition)
      LOCUS_EXCLUDES(mesh_changes_mutex_, changes_mutex_, mutex_);
  struct NamedMesh {
    std::string name;
    MeshPtr mesh;
    uint32_t uses = 0;
  };
  std::vector<NamedMesh> list_meshes(const std::string& after, size_t limit) const LOCUS_EXCLUDES(mutex_);
  size_t mesh_count() const LOCUS_EXCLUDES(mutex_);
  // Returns the memory of all meshes in bytes; a content that several names share counts once. O(meshes).
  uint64_t mesh_bytes() const LOCUS_EXCLUDES(mutex_);
  // Returns the number of instances of `mesh` in the latest revisions of all scenes. Instances of an equal mesh under
  // another name are not counted.
  uint32_t mesh_uses(const StaticMesh* mesh) const LOCUS_EXCLUDES(mutex_);

  // creator_use() returns the sums over the scenes and meshes of one creator; creator_uses() returns these sums for
  // each creator, in the order of names. Damaged scenes and meshes, and scenes and meshes without a creator, are not
  // counted.
  CreatorUse creator_use(const std::string& creator) const LOCUS_EXCLUDES(mutex_);
  std::map<std::string, CreatorUse> creator_uses() const LOCUS_EXCLUDES(mutex_);

  // Add a scene or mesh that was recovered from the log: see core/scene/recovery.h. Call once for each name. Add all
  // meshes before scenes are recovered, because recover_scene() looks meshes up with find_stored(). Meshes of equal
  // content share one content.
  void restore_scene(const ScenePtr& scene) LOCUS_EXCLUDES(mutex_);
  // `grace_s` is the stored result of make_collectable(), or 0.
  void restore_mesh(const std::string& name, MeshPtr mesh, uint32_t grace_s = 0) LOCUS_EXCLUDES(mutex_);
  // Add a damaged scene or mesh: lookups of its name return `damage` (DATA_LOSS) until the scene or mesh is deleted.
  void restore_damaged_scene(const std::string& name, SceneKey key, const absl::Status& damage) LOCUS_EXCLUDES(mutex_);
  void restore_damaged_mesh(const std::string& name, const absl::Status& damage) LOCUS_EXCLUDES(mutex_);

  // Forget a scene, a damaged scene or a mesh, damaged or not, which stays in the log: another server of a cluster
  // leads the scene, or has deleted or replaced the mesh. Do nothing if it is not registered. Close the scene before;
  // the mesh must not be in use.
  void drop_scene(const ScenePtr& scene) LOCUS_EXCLUDES(mutex_) { unregister(*scene); }
  void drop_damaged_scene(const std::string& name, SceneKey key) LOCUS_EXCLUDES(mutex_);
  void drop_mesh(const std::string& name) LOCUS_EXCLUDES(mutex_);

 private:
  struct DamagedScene {
    SceneKey key;
    absl::Status damage;
  };
  // Sums of one creator, who has at least one scene or mesh.
  struct Creator {
    CreatorUse use;  // use.objects is not set; see `objects` below
    uint64_t meshes = 0;
    Scene::ObjectCount objects = std::make_shared<std::atomic<uint64_t>>(0);
  };
  // Result of begin_scene(): the instances that the new scene begins with, or the existing scene of the same name.
  struct Beginning {
    ScenePtr existing;
    std::shared_ptr<const StaticSet> statics;
  };
  absl::StatusOr<Beginning> begin_scene(const std::string& name, const std::string& static_from, bool if_absent) const
      LOCUS_EXCLUDES(mutex_);
  absl::StatusOr<ScenePtr> log_scene(const std::string& name, const SceneSpec& spec, uint64_t epoch,
                                     std::shared_ptr<const StaticSet> statics) LOCUS_REQUIRES(changes_mutex_);
  void put_in(const ScenePtr& scene) LOCUS_EXCLUDES(mutex_);
  // Returns the key of the damaged scene of this name, or nullopt if there is no such scene.
  std::optional<SceneKey> damaged_scene(const std::string& name) const LOCUS_EXCLUDES(mutex_);
  absl::Status delete_damaged_scene(const std::string& name, SceneKey key) LOCUS_REQUIRES(changes_mutex_)
      LOCUS_EXCLUDES(mutex_);
  // Checks whether `mesh` may be added under `name`. If the name is registered with equal content and parts, returns
  // the registered mesh. If the name is free, returns null and replaces `mesh` by to_keep(name, mesh).
  absl::StatusOr<MeshPtr> begin_mesh(const std::string& name, MeshPtr& mesh) const LOCUS_EXCLUDES(mutex_);
  // Returns a mesh with the name `name` and the parts of `mesh`. The returned mesh shares the content of a registered
  // mesh of equal content, or the content of `mesh` if no such mesh is registered.
  MeshPtr to_keep(const std::string& name, MeshPtr mesh) const LOCUS_REQUIRES(mutex_);
  // Removes the mesh `name` from meshes_ and returns it. Returns FAILED_PRECONDITION IN_USE if the mesh is in use. For
  // a damaged mesh, returns null and removes nothing.
  absl::StatusOr<MeshPtr> take_mesh(const std::string& name) LOCUS_EXCLUDES(mutex_);
  // Deletes the mesh `name` from the log. `taken` is the mesh, which was removed from meshes_, or null if the mesh is
  // damaged. If the log fails, restores the name.
  absl::Status delete_taken(const std::string& name, MeshPtr taken) LOCUS_REQUIRES(mesh_changes_mutex_, changes_mutex_)
      LOCUS_EXCLUDES(mutex_);
  // Returns the names of those of `meshes` that are registered and for which no grace of at least `grace_s` seconds is
  // recorded.
  std::vector<std::string> names_to_mark(absl::Span<const StaticMesh* const> meshes, uint32_t grace_s) const
      LOCUS_EXCLUDES(mutex_);
  bool in_use(const StaticMesh* mesh) const LOCUS_REQUIRES(mutex_);
  // Removes a scene that was deleted from its log.
  void unregister(const Scene& scene) LOCUS_EXCLUDES(mutex_);
  // Returns true if `mesh` is the mesh that is registered under its name.
  bool is_kept(const StaticMesh* mesh) const LOCUS_EXCLUDES(mutex_);
  uint32_t count_uses(const StaticMesh* mesh) const LOCUS_REQUIRES(mutex_);
  // add_to_creator() adds a scene or mesh to the sums of its creator; take_from_creator() subtracts it. A creator
  // without scenes and meshes is removed from creators_.
  void add_to_creator(Scene& scene) LOCUS_REQUIRES(mutex_);
  void add_to_creator(const StaticMesh& mesh) LOCUS_REQUIRES(mutex_);
  void take_from_creator(const Scene& scene) LOCUS_REQUIRES(mutex_);
  void take_from_creator(const StaticMesh& mesh) LOCUS_REQUIRES(mutex_);
  void forget_unused_creator(const std::string& creator) LOCUS_REQUIRES(mutex_);
  // Returns the same mesh as find_content(), which locks mutex_ and calls this function.
  MeshPtr content(const Sha256& sha256) const LOCUS_REQUIRES(mutex_);

  UpdateLog* const log_;
  Mutex mesh_changes_mutex_;  // serialises changes of meshes
  Mutex changes_mutex_;       // serialises changes of scenes and deletions of meshes
  mutable Mutex mutex_;
  std::map<std::string, ScenePtr> scenes_ LOCUS_GUARDED_BY(mutex_);
  std::map<std::string, DamagedScene> damaged_scenes_ LOCUS_GUARDED_BY(mutex_);
  std::map<std::string, MeshPtr> meshes_ LOCUS_GUARDED_BY(mutex_);
  std::map<std::string, absl::Status> damaged_meshes_ LOCUS_GUARDED_BY(mutex_);
  std::map<std::string, uint32_t> mesh_graces_ LOCUS_GUARDED_BY(mutex_);  // see make_collectable(); by name
  std::map<std::string, Creator> creators_ LOCUS_GUARDED_BY(mutex_);
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_REGISTRY_H_
