#include "server/storage/check.h"

#include <algorithm>
#include <memory>

#include "absl/strings/str_cat.h"
#include "server/storage/errors.h"
#include "server/storage/judge.h"
#include "server/storage/opening.h"

namespace locus::server {
namespace {

// Reads what can be read; what a strict opening says against it is `damage`.
absl::StatusOr<std::unique_ptr<Database>> open_to_read(const DatabaseOptions& options, std::string& damage) {
  std::unique_ptr<Database> database;
  rocksdb::Status status = Database::open(options, OpenMode::kReadOnly, database);
  if (status.ok()) return database;
  if (!says_damage(status)) return disk_error(absl::StrCat("reading ", options.folder), status);
  damage = status.ToString();
  if (Database::open(options, OpenMode::kReadOnlyLenient, database).ok()) return database;
  return nullptr;
}

void describe(const Findings& findings, DirectoryReport& report) {
  if (!findings.mesh_damage.empty()) report.damage = findings.mesh_damage;
  if (!findings.has_format) report.damage = "its catalogue is lost";
  for (const SceneFinding& scene : findings.scenes)
    report.scenes.push_back(
        {scene.name, scene.row ? scene.row->snapshot_sequence : 0, scene.last, scene.log_bytes, scene.damage});
  for (const MeshFinding& mesh : findings.meshes) report.meshes.push_back({mesh.name, mesh.damage});
}

std::string verdict(const std::string& damage) { return damage.empty() ? "sound" : absl::StrCat("DAMAGED: ", damage); }

}  // namespace

bool DirectoryReport::sound() const {
  const auto is_sound = [](const auto& one) { return one.damage.empty(); };
  return damage.empty() && std::all_of(scenes.begin(), scenes.end(), is_sound) &&
         std::all_of(meshes.begin(), meshes.end(), is_sound);
}

absl::StatusOr<DirectoryReport> check_directory(const StorageOptions& wanted) {
  const StorageOptions options = settled(wanted);
  const DatabaseOptions database_options = database_options_of(options);
  if (!options.env->FileExists(absl::StrCat(options.path, "/", HighWaterFile::kName)).ok() &&
      !options.env->FileExists(database_options.folder).ok())
    return absl::NotFoundError(absl::StrCat("there is no data directory at ", options.path));
  const auto lock = DirectoryLock::take(*options.env, options.path);
  if (!lock.ok()) return lock.status();
  DirectoryReport report;
  const absl::StatusOr<HighWater> high_water = HighWaterFile::read(*options.env, options.path);
  if (absl::IsUnavailable(high_water.status())) return high_water.status();
  if (!high_water.ok()) report.damage = std::string(high_water.status().message());
  if (high_water.ok())
    if (absl::Status list = check_file_list(*options.env, database_options.folder, *high_water); !list.ok())
      report.damage = std::string(list.message());
  absl::StatusOr<std::unique_ptr<Database>> database = open_to_read(database_options, report.damage);
  if (!database.ok()) return database.status();
  if (*database == nullptr) return report;
  const absl::StatusOr<Findings> findings =
      judge(**database, high_water.ok() ? &*high_water : nullptr, Depth::kEverything);
  if (!findings.ok()) return findings.status();
  describe(*findings, report);
  return report;
}

std::string to_text(const DirectoryReport& report) {
  std::string text;
  if (!report.damage.empty()) absl::StrAppend(&text, "directory  ", verdict(report.damage), "\n");
  for (const CheckedScene& scene : report.scenes)
    absl::StrAppend(&text, "scene ", scene.name, "  snapshot to record ", scene.snapshot_sequence, ", log to record ",
                    scene.last_sequence, ", ", scene.log_bytes, " bytes  ", verdict(scene.damage), "\n");
  for (const CheckedMesh& mesh : report.meshes)
    absl::StrAppend(&text, "mesh ", mesh.name, "  ", verdict(mesh.damage), "\n");
  absl::StrAppend(&text, report.scenes.size(), " scenes, ", report.meshes.size(), " meshes: ",
                  report.sound() ? "all is sound" : "not all is sound; restore a backup with `locus restore`", "\n");
  return text;
}

}  // namespace locus::server
