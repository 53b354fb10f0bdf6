#include "core/scene/registry.h"

#include <algorithm>
#include <limits>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/names.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "core/scene/log/mesh_codec.h"
#include "core/scene/log/state_writer.h"
#include "core/scene/log/tree_codec.h"
#include "core/scene/spec_codec.h"

namespace locus {
namespace {

absl::Status refuse_name(absl::StatusCode code, Reason reason, absl::string_view field, absl::string_view message) {
  Refusal refusal;
  refusal.reason = reason;
  refusal.field = std::string(field);
  return refuse(code, message, refusal);
}

// Returns the first entry with a key above `after`, or the first of all entries if `after` is empty.
template <class Map>
auto after_key(const Map& map, const std::string& after) {
  return after.empty() ? map.begin() : map.upper_bound(after);
}

}  // namespace

absl::StatusOr<Registry::Beginning> Registry::begin_scene(const std::string& name, const std::string& static_from,
                                                          bool if_absent) const {
  const MutexLock lock(mutex_);
  if (const auto damaged = damaged_scenes_.find(name); damaged != damaged_scenes_.end()) return damaged->second.damage;
  if (const auto known = scenes_.find(name); known != scenes_.end()) {
    if (if_absent) return Beginning{known->second, nullptr};
    return refuse_name(absl::StatusCode::kAlreadyExists, Reason::kAlreadyExists, "name",
                       absl::StrCat("scene ", name, " exists; choose another name or set if_absent"));
  }
  if (scenes_.size() >= limits::kMaxScenes)
    return refuse_full("name", "scenes", limits::kMaxScenes, static_cast<double>(scenes_.size() + 1), 0);
  if (static_from.empty()) return Beginning{nullptr, StaticSet::empty()};
  if (const auto damaged = damaged_scenes_.find(static_from); damaged != damaged_scenes_.end())
    return damaged->second.damage;
  const auto source = scenes_.find(static_from);
  if (source == scenes_.end()) return no_source(static_from);
  return Beginning{nullptr, source->second->latest()->statics};
}

absl::StatusOr<ScenePtr> Registry::log_scene(const std::string& name, const SceneSpec& spec, uint64_t epoch,
                                             std::shared_ptr<const StaticSet> statics) {
  SceneWriter writer(epoch, spec.winding, std::move(statics), limits::kMaxObjects, spec.history);
  SceneLog on;
  if (log_ != nullptr) {
    FrozenScene beginning;
    beginning.snapshot = writer.published();
    StateWriter state(std::move(beginning));
    ASSIGN_OR_RETURN(SceneKey key,
                     log_->create_scene(name, encode_spec(spec), epoch, [&state] { return state.next(); }));
    on = {log_, key, ack_level(spec.durability), {}};
  }
  return std::make_shared<Scene>(name, spec, std::move(writer), on);
}

// Holds changes_mutex_ during the whole call, so that during the call no other thread creates a scene of the same name
// or deletes a mesh that `static_from` uses.
absl::StatusOr<Registry::CreatedScene> Registry::create_scene(const std::string& name, const SceneSpec& spec,
                                                              uint64_t epoch, const std::string& static_from,
                                                              bool if_absent) {
  RETURN_IF_ERROR(check_scene_name(name, "name"));
  const MutexLock change(changes_mutex_);
  ASSIGN_OR_RETURN(Beginning beginning, begin_scene(name, static_from, if_absent));
  if (beginning.existing != nullptr) return CreatedScene{std::move(beginning.existing), true};
  ASSIGN_OR_RETURN(ScenePtr scene, log_scene(name, spec, epoch, std::move(beginning.statics)));
  put_in(scene);
  return CreatedScene{std::move(scene), false};
}

void Registry::put_in(const ScenePtr& scene) {
  if (log_ != nullptr) scene->check_meshes([this](const StaticMesh* mesh) { return is_kept(mesh); });
  const MutexLock lock(mutex_);
  LOCUS_DCHECK(!scenes_.contains(scene->name()) && !damaged_scenes_.contains(scene->name()));
  scenes_.emplace(scene->name(), scene);
  add_to_creator(*scene);
}

void Registry::add_to_creator(Scene& scene) {
  const SceneSpec& spec = scene.spec();
  if (spec.creator.empty()) return;
  Creator& creator = creators_[spec.creator];
  ++creator.use.scenes;
  creator.use.history_bytes += spec.history.bytes;
  scene.count_objects_in(creator.objects);
}

void Registry::add_to_creator(const StaticMesh& mesh) {
  if (mesh.creator().empty()) return;
  Creator& creator = creators_[mesh.creator()];
  ++creator.meshes;
  creator.use.mesh_bytes += mesh.bytes();
}

void Registry::take_from_creator(const Scene& scene) {
  const SceneSpec& spec = scene.spec();
  if (spec.creator.empty()) return;
  CreatorUse& use = creators_[spec.creator].use;
  LOCUS_DCHECK_GT(use.scenes, uint64_t{0});
  --use.scenes;
  use.history_bytes -= spec.history.bytes;
  forget_unused_creator(spec.creator);
}

void Registry::take_from_creator(const StaticMesh& mesh) {
  if (mesh.creator().empty()) return;
  Creator& creator = creators_[mesh.creator()];
  LOCUS_DCHECK_GT(creator.meshes, uint64_t{0});
  --creator.meshes;
  creator.use.mesh_bytes -= mesh.bytes();
  forget_unused_creator(mesh.creator());
}

void Registry::forget_unused_creator(const std::string& creator) {
  const auto known = creators_.find(creator);
  if (known->second.use.scenes == 0 && known->second.meshes == 0) creators_.erase(known);
}

CreatorUse Registry::creator_use(const std::string& creator) const {
  const MutexLock lock(mutex_);
  const auto known = creators_.find(creator);
  if (known == creators_.end()) return CreatorUse();
  CreatorUse use = known->second.use;
  use.objects = known->second.objects->load();
  return use;
}

std::map<std::string, CreatorUse> Registry::creator_uses() const {
  const MutexLock lock(mutex_);
  std::map<std::string, CreatorUse> uses;
  for (const auto& [name, creator] : creators_) {
    CreatorUse& use = uses[name] = creator.use;
    use.objects = creator.objects->load();
  }
  return uses;
}

absl::StatusOr<ScenePtr> Registry::find_scene(const std::string& name) const {
  const MutexLock lock(mutex_);
  const auto known = scenes_.find(name);
  if (known != scenes_.end()) return known->second;
  if (const auto damaged = damaged_scenes_.find(name); damaged != damaged_scenes_.end()) return damaged->second.damage;
  return no_scene(name);
}

absl::Status Registry::no_source(const std::string& static_from) {
  return refuse_name(absl::StatusCode::kNotFound, Reason::kNotFound, "spec.static_from",
                     absl::StrCat("no scene is called ", static_from));
}

std::optional<SceneKey> Registry::damaged_scene(const std::string& name) const {
  const MutexLock lock(mutex_);
  const auto damaged = damaged_scenes_.find(name);
  return damaged == damaged_scenes_.end() ? std::nullopt : std::optional<SceneKey>(damaged->second.key);
}

absl::Status Registry::delete_damaged_scene(const std::string& name, SceneKey key) {
  RETURN_IF_ERROR(log_->delete_scene(key));
  const MutexLock lock(mutex_);
  damaged_scenes_.erase(name);
  return absl::OkStatus();
}

absl::Status Registry::delete_scene(const std::string& name) {
  const MutexLock change(changes_mutex_);
  if (const std::optional<SceneKey> key = damaged_scene(name)) return delete_damaged_scene(name, *key);
  absl::StatusOr<ScenePtr> scene = find_scene(name);
  if (!scene.ok())
    return refuse_name(absl::StatusCode::kNotFound, Reason::kNotFound, "name",
                       absl::StrCat("no scene is called '", name, "'"));
  // remove() closes the scene once the deletion is logged. Until then the scene can be found.
  RETURN_IF_ERROR((*scene)->remove());
  unregister(**scene);
  return absl::OkStatus();
}

absl::StatusOr<bool> Registry::delete_scene_if(const ScenePtr& scene, absl::FunctionRef<bool()> condition) {
  const MutexLock change(changes_mutex_);
  const absl::StatusOr<ScenePtr> known = find_scene(scene->name());
  if (!known.ok() || *known != scene) return false;
  ASSIGN_OR_RETURN(const bool removed, scene->remove_if(condition));
  if (removed) unregister(*scene);
  return removed;
}

void Registry::unregister(const Scene& scene) {
  const MutexLock lock(mutex_);
  const auto known = scenes_.find(scene.name());
  if (known == scenes_.end() || known->second.get() != &scene) return;  // dropped meanwhile
  take_from_creator(scene);
  scenes_.erase(known);
}

std::vector<ScenePtr> Registry::list_scenes(const std::string& after, size_t limit) const {
  const MutexLock lock(mutex_);
  std::vector<ScenePtr> result;
  for (auto it = after_key(scenes_, after); it != scenes_.end() && result.size() < limit; ++it)
    result.push_back(it->second);
  return result;
}

std::vector<Registry::Damaged> Registry::damaged_scenes() const {
  const MutexLock lock(mutex_);
  std::vector<Damaged> result;
  for (const auto& [name, scene] : damaged_scenes_) result.push_back({name, scene.damage});
  return result;
}

size_t Registry::scene_count() const {
  const MutexLock lock(mutex_);
  return scenes_.size();
}

MeshPtr Registry::find_content(const Sha256& sha256) const {
  const MutexLock lock(mutex_);
  return content(sha256);
}

MeshPtr Registry::find_stored(const MeshKey& key) const {
  const MutexLock lock(mutex_);
  if (key.name.empty()) return content(key.sha256);
  const auto known = meshes_.find(key.name);
  return known != meshes_.end() && known->second->sha256() == key.sha256 ? known->second : nullptr;
}

MeshPtr Registry::content(const Sha256& sha256) const {
  for (const auto& [name, mesh] : meshes_)
    if (mesh->sha256() == sha256) return mesh;
  return nullptr;
}

absl::StatusOr<MeshPtr> Registry::find_mesh(const std::string& name, absl::string_view field) const {
  const MutexLock lock(mutex_);
  const auto known = meshes_.find(name);
  if (known != meshes_.end()) return known->second;
  if (const auto damaged = damaged_meshes_.find(name); damaged != damaged_meshes_.end()) return damaged->second;
  return refuse_name(absl::StatusCode::kNotFound, Reason::kNotFound, field,
                     absl::StrCat("no mesh is called '", name, "'; upload it first"));
}

absl::StatusOr<MeshPtr> Registry::begin_mesh(const std::string& name, MeshPtr& mesh) const {
  const MutexLock lock(mutex_);
  if (const auto damaged = damaged_meshes_.find(name); damaged != damaged_meshes_.end()) return damaged->second;
  if (const auto known = meshes_.find(name); known != meshes_.end()) {
    const bool equal_content = known->second->sha256() == mesh->sha256();
    if (equal_content && known->second->parts() == mesh->parts()) return known->second;
    return refuse_name(absl::StatusCode::kAlreadyExists, Reason::kAlreadyExists, "mesh",
                       absl::StrCat("mesh ", name, " exists with other ", equal_content ? "parts" : "content",
                                    "; delete it or choose another name"));
  }
  if (meshes_.size() >= limits::kMaxMeshes)
    return refuse_full("mesh", "meshes", limits::kMaxMeshes, static_cast<double>(meshes_.size() + 1), 0);
  mesh = to_keep(name, std::move(mesh));
  return MeshPtr();
}

MeshPtr Registry::to_keep(const std::string& name, MeshPtr mesh) const {
  const MeshPtr equal = content(mesh->sha256());
  if (equal == nullptr && mesh->name() == name) return mesh;
  return StaticMesh::share(name, mesh->parts(), equal == nullptr ? *mesh : *equal, mesh->creator());
}

absl::StatusOr<MeshPtr> Registry::add_mesh(const std::string& name, MeshPtr mesh) {
  RETURN_IF_ERROR(check_mesh_name(name, "mesh"));
  const MutexLock change(mesh_changes_mutex_);
  absl::StatusOr<MeshPtr> known = begin_mesh(name, mesh);
  if (!known.ok() || *known != nullptr) return known;
  if (log_ != nullptr) {
    std::optional<MeshWriter> content;  // created only if the log has not stored the content yet
    const auto next = [&]() -> absl::StatusOr<std::optional<std::string>> {
      if (!content) content.emplace(mesh);
      return content->next();
    };
    PartsWriter parts(mesh);
    const auto next_parts = [&parts] { return parts.next(); };
    RETURN_IF_ERROR(log_->add_mesh(name, mesh->sha256(), next, next_parts));
    if (content) log_->store_topology(mesh->sha256(), encode_topology(mesh->tree().topology()));
  }
  const MutexLock lock(mutex_);
  const auto [kept, added] = meshes_.emplace(name, mesh);  // in a cluster, a reader may have added it meanwhile
  if (added) add_to_creator(*mesh);
  return kept->second;
}

uint32_t Registry::count_uses(const StaticMesh* mesh) const {
  uint32_t uses = 0;
  for (const auto& [name, scene] : scenes_) uses += scene->latest()->statics->uses(mesh);
  return uses;
}

bool Registry::in_use(const StaticMesh* mesh) const {
  return std::any_of(scenes_.begin(), scenes_.end(), [mesh](const auto& entry) { return entry.second->in_use(mesh); });
}

absl::StatusOr<MeshPtr> Registry::take_mesh(const std::string& name) {
  const MutexLock lock(mutex_);
  if (damaged_meshes_.contains(name)) return MeshPtr();
  const auto known = meshes_.find(name);
  if (known == meshes_.end())
    return refuse_name(absl::StatusCode::kNotFound, Reason::kNotFound, "mesh",
                       absl::StrCat("no mesh is called '", name, "'"));
  const StaticMesh* mesh = known->second.get();
  if (in_use(mesh)) {
    const uint32_t uses = count_uses(mesh);
    Refusal refusal;
    refusal.reason = Reason::kInUse;
    refusal.field = "mesh";
    refusal.asked = uses;
    return refuse(absl::StatusCode::kFailedPrecondition,
                  uses > 0 ? absl::StrCat("mesh ", name, " is used by ", uses, " instances; remove them first")
                           : absl::StrCat("mesh ", name, " is being placed; try again once that is done"),
                  refusal);
  }
  MeshPtr taken = std::move(known->second);
  meshes_.erase(known);
  take_from_creator(*taken);
  return taken;
}

// Removes the name first, so that no scene starts to use the mesh while the log deletes it, and restores the name if
// the log fails.
absl::Status Registry::delete_mesh(const std::string& name) {
  const MutexLock mesh_change(mesh_changes_mutex_);
  const MutexLock change(changes_mutex_);
  ASSIGN_OR_RETURN(MeshPtr taken, take_mesh(name));
  return delete_taken(name, std::move(taken));
}

absl::StatusOr<bool> Registry::delete_mesh_if(const MeshPtr& mesh, absl::FunctionRef<bool()> condition) {
  const MutexLock mesh_change(mesh_changes_mutex_);
  const MutexLock change(changes_mutex_);
  MeshPtr taken;
  {
    const MutexLock lock(mutex_);
    const auto known = meshes_.find(mesh->name());
    if (known == meshes_.end() || known->second != mesh || in_use(mesh.get()) || !condition()) return false;
    taken = std::move(known->second);
    meshes_.erase(known);
    take_from_creator(*taken);
  }
  RETURN_IF_ERROR(delete_taken(mesh->name(), std::move(taken)));
  return true;
}

absl::Status Registry::delete_taken(const std::string& name, MeshPtr taken) {
  const absl::Status status = log_ == nullptr ? absl::OkStatus() : log_->delete_mesh(name);
  if (taken != nullptr && status.ok())
    for (const ScenePtr& scene : list_scenes("", std::numeric_limits<size_t>::max())) scene->forget_mesh(taken.get());
  const MutexLock lock(mutex_);
  if (status.ok()) mesh_graces_.erase(name);
  if (taken == nullptr && status.ok()) damaged_meshes_.erase(name);
  if (taken == nullptr || status.ok()) return status;
  const auto [known, added] = meshes_.emplace(name, std::move(taken));
  if (added) add_to_creator(*known->second);
  return status;
}

std::vector<std::string> Registry::names_to_mark(absl::Span<const StaticMesh* const> meshes, uint32_t grace_s) const {
  std::vector<std::string> names;
  const MutexLock lock(mutex_);
  for (const StaticMesh* const mesh : meshes) {
    const auto known = meshes_.find(mesh->name());
    if (known == meshes_.end() || known->second.get() != mesh) continue;
    const auto grace = mesh_graces_.find(mesh->name());
    if (grace == mesh_graces_.end() || grace->second < grace_s) names.push_back(mesh->name());
  }
  return names;
}

absl::Status Registry::make_collectable(absl::Span<const StaticMesh* const> meshes, uint32_t grace_s) {
  // Most calls find the records; these calls do not wait for a mesh that is being written.
  if (names_to_mark(meshes, grace_s).empty()) return absl::OkStatus();
  const MutexLock change(mesh_changes_mutex_);
  const std::vector<std::string> names = names_to_mark(meshes, grace_s);
  if (names.empty()) return absl::OkStatus();
  if (log_ != nullptr) RETURN_IF_ERROR(log_->set_mesh_graces(names, grace_s));
  const MutexLock lock(mutex_);
  for (const std::string& name : names) mesh_graces_[name] = grace_s;
  return absl::OkStatus();
}

std::vector<Registry::CollectableMesh> Registry::collectable_meshes() const {
  const MutexLock lock(mutex_);
  std::vector<CollectableMesh> meshes;
  for (const auto& [name, grace_s] : mesh_graces_)
    if (const auto known = meshes_.find(name); known != meshes_.end()) meshes.push_back({known->second, grace_s});
  return meshes;
}

absl::flat_hash_set<const StaticMesh*> Registry::used_meshes() const {
  absl::flat_hash_set<const StaticMesh*> meshes;
  for (const ScenePtr& scene : list_scenes("", std::numeric_limits<size_t>::max())) scene->add_used_meshes(meshes);
  return meshes;
}

bool Registry::is_kept(const StaticMesh* mesh) const {
  const MutexLock lock(mutex_);
  const auto known = meshes_.find(mesh->name());
  return known != meshes_.end() && known->second.get() == mesh;
}

void Registry::restore_scene(const ScenePtr& scene) { put_in(scene); }

void Registry::restore_mesh(const std::string& name, MeshPtr mesh, uint32_t grace_s) {
  const MutexLock lock(mutex_);
  mesh = to_keep(name, std::move(mesh));
  if (meshes_.emplace(name, mesh).second) add_to_creator(*mesh);
  if (grace_s != 0) mesh_graces_[name] = grace_s;
}

void Registry::restore_damaged_scene(const std::string& name, SceneKey key, const absl::Status& damage) {
  LOCUS_CHECK(log_ != nullptr && !damage.ok());
  const MutexLock lock(mutex_);
  damaged_scenes_.emplace(name, DamagedScene{key, damage});
}

void Registry::restore_damaged_mesh(const std::string& name, const absl::Status& damage) {
  LOCUS_CHECK(log_ != nullptr && !damage.ok());
  const MutexLock lock(mutex_);
  damaged_meshes_.emplace(name, damage);
}

void Registry::drop_damaged_scene(const std::string& name, SceneKey key) {
  const MutexLock lock(mutex_);
  const auto known = damaged_scenes_.find(name);
  if (known != damaged_scenes_.end() && known->second.key == key) damaged_scenes_.erase(known);
}

void Registry::drop_mesh(const std::string& name) {
  MeshPtr dropped;
  const MutexLock lock(mutex_);
  damaged_meshes_.erase(name);
  mesh_graces_.erase(name);
  const auto known = meshes_.find(name);
  if (known == meshes_.end()) return;
  dropped = known->second;
  take_from_creator(*dropped);
  meshes_.erase(known);
}

std::vector<Registry::NamedMesh> Registry::list_meshes(const std::string& after, size_t limit) const {
  const MutexLock lock(mutex_);
  std::vector<NamedMesh> result;
  for (auto it = after_key(meshes_, after); it != meshes_.end() && result.size() < limit; ++it)
    result.push_back({it->first, it->second, count_uses(it->second.get())});
  return result;
}

uint32_t Registry::mesh_uses(const StaticMesh* mesh) const {
  const MutexLock lock(mutex_);
  return count_uses(mesh);
}

uint64_t Registry::mesh_bytes() const {
  std::vector<MeshPtr> meshes;  // counted after the lock is released
  {
    const MutexLock lock(mutex_);
    meshes.reserve(meshes_.size());
    for (const auto& [name, mesh] : meshes_) meshes.push_back(mesh);
  }
  uint64_t bytes = 0;
  std::set<const TriangleBvh*> counted;
  for (const MeshPtr& mesh : meshes)
    bytes += mesh->bytes() - (counted.insert(&mesh->tree()).second ? 0 : mesh->shared_bytes());
  return bytes;
}

size_t Registry::mesh_count() const {
  const MutexLock lock(mutex_);
  return meshes_.size();
}

}  // namespace locus
