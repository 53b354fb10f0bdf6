// Members of PostgresLog that claim meshes for scenes.
#include <algorithm>
#include <map>
#include <utility>

#include "core/base/status_macros.h"
#include "server/storage/postgres_log.h"
#include "server/storage/rows/refusals.h"

namespace locus::server {
namespace {

// Locks the meshes of these names, in the order in which other transactions lock them, so that they are not deleted
// before the commit, and checks their contents.
absl::Status lock_meshes(EngineConnection& connection, absl::Span<const absl::string_view> names,
                         absl::Span<const MeshUse> uses, Deadline deadline) {
  connection.add(
      "SELECT name, sha256 FROM locus.mesh WHERE name = ANY($1::text[]) ORDER BY name COLLATE \"C\" FOR KEY SHARE",
      SqlParameters().list_of_texts(names));
  RETURN_IF_ERROR(connection.run(deadline));
  const EngineRows& found = connection.results()[0];
  std::map<absl::string_view, absl::string_view> stored;
  for (size_t row = 0; row < found.size(); ++row) stored.emplace(found.bytes(row, 0), found.bytes(row, 1));
  for (const MeshUse& use : uses) {
    const auto mesh = stored.find(use.name);
    if (mesh == stored.end()) return mesh_not_stored(use.name);
    if (mesh->second != view_of(use.sha256)) return mesh_content_not_stored(use.name);
  }
  return absl::OkStatus();
}

// Returns the claims of a scene. Locks nothing.
absl::StatusOr<std::map<std::string, uint64_t>> read_uses(EngineConnection& connection, SceneKey scene,
                                                          Deadline deadline) {
  connection.add("SELECT name, instances FROM locus.scene_mesh WHERE scene = $1::bigint",
                 SqlParameters().number(scene));
  RETURN_IF_ERROR(connection.run(deadline));
  const EngineRows& found = connection.results()[0];
  std::map<std::string, uint64_t> uses;
  for (size_t row = 0; row < found.size(); ++row) uses[std::string(found.bytes(row, 0))] = found.number(row, 1);
  return uses;
}

}  // namespace

absl::Status PostgresLog::insert_uses(EngineConnection& connection, SceneKey scene,
                                      absl::Span<const MeshUse> uses) const {
  if (uses.empty()) return absl::OkStatus();
  std::vector<absl::string_view> names;
  std::vector<uint64_t> numbers;
  for (const MeshUse& use : uses) {
    names.push_back(use.name);
    numbers.push_back(use.instances);
  }
  RETURN_IF_ERROR(connection.run(answer_deadline()));  // what was added before, whose results come first
  RETURN_IF_ERROR(lock_meshes(connection, names, uses, answer_deadline()));
  connection.add(
      "INSERT INTO locus.scene_mesh (scene, name, instances)"
      " SELECT $1::bigint, n.name, n.instances FROM unnest($2::text[], $3::bigint[]) AS n (name, instances)",
      SqlParameters().number(scene).list_of_texts(names).numbers(numbers));
  return connection.run(answer_deadline());
}

absl::Status PostgresLog::claim_meshes(SceneKey scene, absl::Span<const MeshUse> uses) {
  return uses.empty() ? absl::OkStatus() : change_uses(scene, uses, UseChange::kAdd);
}

absl::Status PostgresLog::set_mesh_uses(SceneKey scene, absl::Span<const MeshUse> uses) {
  return change_uses(scene, uses, UseChange::kReplace);
}

absl::Status PostgresLog::change_uses(SceneKey key, absl::Span<const MeshUse> uses, UseChange change) {
  ASSIGN_OR_RETURN(const LedPtr state, led(key));
  Led& scene = *state;
  std::map<absl::string_view, uint64_t> instances_of;
  for (const MeshUse& use : uses) instances_of[use.name] += use.instances;
  std::vector<absl::string_view> names;
  for (const auto& [name, instances] : instances_of) names.push_back(name);

  const Report report(*this, scene);
  MutexLock writing(scene.writing);
  bool fenced = false;
  std::map<std::string, uint64_t> after;  // the claims of the scene when `write` has succeeded
  const auto write = [&](EngineConnection& connection) LOCUS_REQUIRES(scene.writing) -> absl::Status {
    RETURN_IF_ERROR(guard(connection, scene, fenced));
    RETURN_IF_ERROR(lock_meshes(connection, names, uses, answer_deadline()));
    ASSIGN_OR_RETURN(const auto before, read_uses(connection, key, answer_deadline()));
    after = change == UseChange::kAdd ? before : std::map<std::string, uint64_t>();
    for (const auto& [name, instances] : instances_of)
      if (change == UseChange::kAdd || instances > 0) after[std::string(name)] += instances;
    if (after == before) return absl::OkStatus();
    std::vector<absl::string_view> changed, removed;
    std::vector<uint64_t> numbers;
    for (const auto& [name, instances] : after) {
      const auto known = before.find(name);
      if (known != before.end() && known->second == instances) continue;
      changed.push_back(name);
      numbers.push_back(instances);
    }
    for (const auto& [name, instances] : before)
      if (!after.contains(name)) removed.push_back(name);
    connection.add("DELETE FROM locus.scene_mesh WHERE scene = $1::bigint AND name = ANY($2::text[])",
                   SqlParameters().number(key).list_of_texts(removed));
    connection.add(
        "INSERT INTO locus.scene_mesh (scene, name, instances)"
        " SELECT $1::bigint, n.name, n.instances FROM unnest($2::text[], $3::bigint[]) AS n (name, instances)"
        " ON CONFLICT (scene, name) DO UPDATE SET instances = EXCLUDED.instances",
        SqlParameters().number(key).list_of_texts(changed).numbers(numbers));
    return connection.run(answer_deadline());
  };
  // The lock of the scene's row waits for the lost transaction, which has it. Nobody else claims for the scene.
  const auto was_done = [&](EngineConnection& connection) -> absl::StatusOr<bool> {
    RETURN_IF_ERROR(connection.run("BEGIN", answer_deadline()));
    connection.add("SELECT token FROM locus.scene_log WHERE scene = $1::bigint FOR UPDATE",
                   SqlParameters().number(key));
    RETURN_IF_ERROR(connection.run(answer_deadline()));
    ASSIGN_OR_RETURN(const auto found, read_uses(connection, key, answer_deadline()));
    connection.add("ROLLBACK");
    RETURN_IF_ERROR(run_barrier(connection));
    return found == after;
  };
  const absl::Status status = transact(EnginePool::Use::kUrgent, write, was_done);
  if (absl::IsAborted(status) && fenced) set_fenced(scene);
  return status;
}

}  // namespace locus::server
