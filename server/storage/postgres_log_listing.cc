// Members of PostgresLog that list scenes and meshes, also those that this daemon does not lead.
#include <algorithm>
#include <limits>
#include <thread>
#include <utility>

#include "core/base/status_macros.h"
#include "server/storage/postgres_log.h"

namespace locus::server {
namespace {

constexpr auto kReadBackoff = std::chrono::milliseconds(50);  // pause between two attempts

#define LOCUS_CATALOGUED        \
  "SELECT " LOCUS_SCENE_COLUMNS \
  ", l.leader, l.token, l.last FROM locus.scene s JOIN locus.scene_log l ON l.scene = s.key "
#define LOCUS_MESHES "SELECT " LOCUS_MESH_COLUMNS " FROM locus.mesh m "

CatalogueScene catalogued(const EngineRows& rows, size_t row) {
  CatalogueScene scene;
  scene.key = rows.number(row, 0);
  scene.name = std::string(rows.bytes(row, 1));
  const absl::StatusOr<StoredSceneRow> found = scene_row(rows, row);
  scene.damage = found.status();
  if (found.ok()) {
    scene.spec = found->spec;
    scene.epoch = found->epoch;
  }
  scene.member = rows.number(row, kSceneColumns);
  scene.token = rows.number(row, kSceneColumns + 1);
  scene.last_sequence = rows.number(row, kSceneColumns + 2);
  return scene;
}

// Returns the limit of a statement, whose numbers are signed.
uint64_t row_limit(size_t limit) { return std::min<uint64_t>(limit, std::numeric_limits<int64_t>::max()); }

}  // namespace

absl::Status PostgresLog::list_stored() {
  ASSIGN_OR_RETURN(const EnginePool::Lease lease, begin_read());
  lease->add(LOCUS_STORED_SCENES "ORDER BY s.name");
  lease->add(LOCUS_MESHES "ORDER BY m.name");
  lease->add("COMMIT");
  RETURN_IF_ERROR(lease->run(change_deadline()));
  const EngineRows& scenes = lease->results()[0];
  for (size_t row = 0; row < scenes.size(); ++row) stored_scenes_.push_back(stored_scene(scenes, row));
  const EngineRows& meshes = lease->results()[1];
  for (size_t row = 0; row < meshes.size(); ++row) stored_meshes_.push_back(stored_mesh(meshes, row));
  return absl::OkStatus();
}

absl::Status PostgresLog::read_committed(const char* sql, const SqlParameters& parameters,
                                         absl::FunctionRef<void(const EngineRows&)> use) const {
  const Deadline deadline = change_deadline();
  while (true) {
    ASSIGN_OR_RETURN(const EnginePool::Lease lease, acquire(EnginePool::Use::kUrgent, deadline));
    lease->add(sql, parameters);
    add_barrier(*lease);
    const absl::Status status = run_checked(*lease, options_.replication, std::min(deadline, answer_deadline()));
    if (status.ok()) {
      use(lease->results()[0]);
      return status;
    }
    if (!lease->lost() || std::chrono::steady_clock::now() + kReadBackoff >= deadline) return status;
    std::this_thread::sleep_for(kReadBackoff);
  }
}

absl::StatusOr<std::optional<CatalogueScene>> PostgresLog::find_catalogued(absl::string_view name) const {
  std::optional<CatalogueScene> scene;
  RETURN_IF_ERROR(read_committed(LOCUS_CATALOGUED "WHERE s.name = $1::text", SqlParameters().text(name),
                                 [&](const EngineRows& rows) {
                                   if (!rows.empty()) scene = catalogued(rows, 0);
                                 }));
  return scene;
}

absl::StatusOr<std::vector<CatalogueScene>> PostgresLog::list_catalogued(absl::string_view after, size_t limit) const {
  std::vector<CatalogueScene> scenes;
  RETURN_IF_ERROR(read_committed(LOCUS_CATALOGUED "WHERE s.name > $1::text ORDER BY s.name LIMIT $2::bigint",
                                 SqlParameters().text(after).number(row_limit(limit)), [&](const EngineRows& rows) {
                                   for (size_t row = 0; row < rows.size(); ++row)
                                     scenes.push_back(catalogued(rows, row));
                                 }));
  return scenes;
}

absl::StatusOr<std::optional<StoredMesh>> PostgresLog::find_stored_mesh(absl::string_view name) const {
  std::optional<StoredMesh> mesh;
  RETURN_IF_ERROR(
      read_committed(LOCUS_MESHES "WHERE m.name = $1::text", SqlParameters().text(name), [&](const EngineRows& rows) {
        if (!rows.empty()) mesh = stored_mesh(rows, 0);
      }));
  return mesh;
}

absl::StatusOr<std::vector<StoredMesh>> PostgresLog::list_stored_meshes(absl::string_view after, size_t limit) const {
  std::vector<StoredMesh> meshes;
  RETURN_IF_ERROR(read_committed(LOCUS_MESHES "WHERE m.name > $1::text ORDER BY m.name LIMIT $2::bigint",
                                 SqlParameters().text(after).number(row_limit(limit)), [&](const EngineRows& rows) {
                                   for (size_t row = 0; row < rows.size(); ++row)
                                     meshes.push_back(stored_mesh(rows, row));
                                 }));
  return meshes;
}

}  // namespace locus::server
