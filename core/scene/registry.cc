#include "core/scene/registry.h"

#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"

namespace locus {
namespace {

absl::Status refuse_name(absl::StatusCode code, Reason reason, absl::string_view field, absl::string_view message) {
  Refusal refusal;
  refusal.reason = reason;
  refusal.field = std::string(field);
  return refuse(code, message, refusal);
}

bool name_character(char c) { return absl::ascii_islower(c) || absl::ascii_isdigit(c); }

// The entries of a map after a key, in order.
template <class Map>
auto after_key(const Map& map, const std::string& after) {
  return after.empty() ? map.begin() : map.upper_bound(after);
}

}  // namespace

absl::Status check_scene_name(absl::string_view name, absl::string_view field) {
  bool good = !name.empty() && name.size() <= limits::kMaxNameLength && absl::ascii_islower(name.front()) &&
              name_character(name.back());
  for (const char c : name) good = good && (name_character(c) || c == '-');
  if (good) return absl::OkStatus();
  return refuse_argument(Reason::kMalformed, field, {},
                         "a scene's name has 1 to 63 of a-z, 0-9 and -, starts with a letter, does not end with -");
}

absl::Status check_mesh_name(absl::string_view name, absl::string_view field) {
  bool good = !name.empty() && name.size() <= limits::kMaxNameLength;
  for (const char c : name) good = good && absl::ascii_isgraph(c);
  if (good) return absl::OkStatus();
  return refuse_argument(Reason::kMalformed, field, {}, "a mesh's name has 1 to 63 printable characters, no spaces");
}

absl::StatusOr<Registry::CreatedScene> Registry::create_scene(const std::string& name, const SceneSpec& spec,
                                                              uint64_t epoch, const std::string& static_from,
                                                              bool if_absent) {
  if (absl::Status status = check_scene_name(name, "name"); !status.ok()) return status;
  const MutexLock lock(mutex_);
  if (const auto known = scenes_.find(name); known != scenes_.end()) {
    if (if_absent) return CreatedScene{known->second, true};
    return refuse_name(absl::StatusCode::kAlreadyExists, Reason::kAlreadyExists, "name",
                       absl::StrCat("scene ", name, " exists; choose another name or set if_absent"));
  }
  if (scenes_.size() >= limits::kMaxScenes)
    return refuse_full("name", "scenes", limits::kMaxScenes, static_cast<double>(scenes_.size() + 1), 0);
  std::shared_ptr<const StaticSet> statics = StaticSet::empty();
  if (!static_from.empty()) {
    const auto source = scenes_.find(static_from);
    if (source == scenes_.end())
      return refuse_name(absl::StatusCode::kNotFound, Reason::kNotFound, "spec.static_from",
                         absl::StrCat("no scene is called ", static_from));
    statics = source->second->latest()->statics;
  }
  auto scene = std::make_shared<Scene>(name, spec, epoch, std::move(statics));
  scenes_.emplace(name, scene);
  return CreatedScene{std::move(scene), false};
}

absl::StatusOr<ScenePtr> Registry::find_scene(const std::string& name) const {
  const MutexLock lock(mutex_);
  const auto known = scenes_.find(name);
  if (known != scenes_.end()) return known->second;
  return refuse_name(absl::StatusCode::kNotFound, Reason::kNotFound, "scene",
                     absl::StrCat("no scene is called '", name, "'; create it first"));
}

absl::Status Registry::delete_scene(const std::string& name) {
  ScenePtr scene;
  {
    const MutexLock lock(mutex_);
    const auto known = scenes_.find(name);
    if (known == scenes_.end())
      return refuse_name(absl::StatusCode::kNotFound, Reason::kNotFound, "name",
                         absl::StrCat("no scene is called '", name, "'"));
    scene = std::move(known->second);
    scenes_.erase(known);
  }
  scene->close();
  return absl::OkStatus();
}

std::vector<ScenePtr> Registry::list_scenes(const std::string& after, size_t limit) const {
  const MutexLock lock(mutex_);
  std::vector<ScenePtr> result;
  for (auto it = after_key(scenes_, after); it != scenes_.end() && result.size() < limit; ++it)
    result.push_back(it->second);
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

MeshPtr Registry::content(const Sha256& sha256) const {
  for (const auto& [name, mesh] : meshes_)
    if (mesh->sha256() == sha256) return mesh;
  return nullptr;
}

absl::StatusOr<MeshPtr> Registry::find_mesh(const std::string& name, absl::string_view field) const {
  const MutexLock lock(mutex_);
  const auto known = meshes_.find(name);
  if (known != meshes_.end()) return known->second;
  return refuse_name(absl::StatusCode::kNotFound, Reason::kNotFound, field,
                     absl::StrCat("no mesh is called '", name, "'; upload it first"));
}

absl::StatusOr<MeshPtr> Registry::add_mesh(const std::string& name, MeshPtr mesh) {
  if (absl::Status status = check_mesh_name(name, "mesh"); !status.ok()) return status;
  const MutexLock lock(mutex_);
  if (const auto known = meshes_.find(name); known != meshes_.end()) {
    if (known->second->sha256() == mesh->sha256()) return known->second;
    return refuse_name(absl::StatusCode::kAlreadyExists, Reason::kAlreadyExists, "mesh",
                       absl::StrCat("mesh ", name, " exists with other content; delete it or choose another name"));
  }
  if (meshes_.size() >= limits::kMaxMeshes)
    return refuse_full("mesh", "meshes", limits::kMaxMeshes, static_cast<double>(meshes_.size() + 1), 0);
  if (MeshPtr equal = content(mesh->sha256()); equal != nullptr) mesh = std::move(equal);
  meshes_.emplace(name, mesh);
  return mesh;
}

uint32_t Registry::count_uses(const StaticMesh* mesh) const {
  uint32_t uses = 0;
  for (const auto& [name, scene] : scenes_) uses += scene->latest()->statics->uses(mesh);
  return uses;
}

absl::Status Registry::delete_mesh(const std::string& name) {
  const MutexLock lock(mutex_);
  const auto known = meshes_.find(name);
  if (known == meshes_.end())
    return refuse_name(absl::StatusCode::kNotFound, Reason::kNotFound, "mesh",
                       absl::StrCat("no mesh is called '", name, "'"));
  if (const uint32_t uses = count_uses(known->second.get()); uses > 0) {
    Refusal refusal;
    refusal.reason = Reason::kInUse;
    refusal.field = "mesh";
    refusal.asked = uses;
    return refuse(absl::StatusCode::kFailedPrecondition,
                  absl::StrCat("mesh ", name, " is used by ", uses, " instances; remove them first"), refusal);
  }
  meshes_.erase(known);
  return absl::OkStatus();
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

size_t Registry::mesh_count() const {
  const MutexLock lock(mutex_);
  return meshes_.size();
}

}  // namespace locus
