#include "server/storage/integrity/check.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/storage/integrity/opening.h"
#include "server/storage/rocksdb/errors.h"

namespace locus::server {
namespace {

// Locks the directory, so that no process writes during the check. Returns OK with a null `lock` in two cases: a backup
// that was never opened has no lock file, and a lock file on a read-only disk cannot be locked.
absl::Status acquire_lock(const StorageOptions& options, std::unique_ptr<DirectoryLock>& lock) {
  if (!options.env->FileExists(absl::StrCat(options.path, "/", DirectoryLock::kName)).ok()) return absl::OkStatus();
  auto taken = DirectoryLock::acquire(*options.env, options.path);
  if (absl::IsFailedPrecondition(taken.status())) return taken.status();
  if (taken.ok()) lock = *std::move(taken);
  return absl::OkStatus();
}

std::string verdict(const std::string& damage) { return damage.empty() ? "intact" : absl::StrCat("DAMAGED: ", damage); }

}  // namespace

bool DirectoryReport::intact() const {
  const auto is_intact = [](const auto& part) { return part.damage.empty(); };
  return damage.empty() && catalogue_damage.empty() && std::all_of(scenes.begin(), scenes.end(), is_intact) &&
         std::all_of(meshes.begin(), meshes.end(), is_intact);
}

DirectoryReport report_of(const DamageReport& damage_report) {
  DirectoryReport report;
  if (!damage_report.has_format) report.damage = "the catalogue is lost";
  report.catalogue_damage = damage_report.catalogue_damage;
  for (const SceneHealth& found : damage_report.scenes) {
    SceneReport& scene = report.scenes.emplace_back();
    scene.key = found.key;
    scene.name = found.name;
    scene.last_sequence = found.last;
    scene.expected_sequence = found.expected_sequence;
    scene.log_bytes = found.log_bytes;
    scene.damage = found.damage;
    if (!found.row) continue;
    scene.epoch = found.row->epoch;
    scene.snapshot_sequence = found.row->snapshot_sequence;
    scene.snapshot_chunks = found.row->snapshot.chunks;
    scene.snapshot_bytes = found.row->snapshot.bytes;
  }
  std::sort(report.scenes.begin(), report.scenes.end(),
            [](const SceneReport& a, const SceneReport& b) { return a.name < b.name; });
  for (const MeshHealth& found : damage_report.meshes)
    report.meshes.push_back({found.name, found.sha256, found.content.chunks.bytes, found.damage});
  return report;
}

absl::StatusOr<DirectoryReport> check(const StorageOptions& given, ProgressWriter* progress) {
  const StorageOptions options = with_defaults(given);
  const DatabaseOptions wanted = database_options_of(options);
  if (!options.env->FileExists(wanted.folder).ok() &&
      !options.env->FileExists(absl::StrCat(options.path, "/", DurableMarkerFile::kName)).ok())
    return absl::NotFoundError(absl::StrCat(options.path, " is no data directory"));
  std::unique_ptr<DirectoryLock> lock;
  RETURN_IF_ERROR(acquire_lock(options, lock));

  DirectoryReport report;
  const absl::StatusOr<DurableMarker> durable_marker = DurableMarkerFile::read(*options.env, options.path);
  if (absl::IsUnavailable(durable_marker.status())) return durable_marker.status();
  if (durable_marker.ok()) {
    const absl::Status list = check_file_list(*options.env, wanted.folder, *durable_marker);
    if (!list.ok() && !absl::IsDataLoss(list)) return list;
    report.damage = std::string(list.message());
    if (!list.ok()) return report;
  }
  if (progress != nullptr) progress->begin({.action = "opening", .subject = options.path});
  std::unique_ptr<Database> database;
  const rocksdb::Status strict = Database::open(wanted, OpenMode::kReadOnly, database);
  if (!strict.ok() && !is_damage(strict)) return disk_error(absl::StrCat("opening ", options.path), strict);
  if (!strict.ok() && !Database::open(wanted, OpenMode::kReadOnlyLenient, database).ok()) {
    report.damage = strict.ToString();
    return report;
  }
  if (progress != nullptr) progress->begin({.action = "checking", .subject = options.path, .unit = kProgressBytes});
  ASSIGN_OR_RETURN(const DamageReport damage_report,
                   verify(*database, durable_marker.ok() ? &*durable_marker : nullptr, Depth::kEverything, progress));
  report = report_of(damage_report);
  report.closed_in_order = durable_marker.ok() && durable_marker->closed;
  return report;
}

std::string to_text(const DirectoryReport& report) {
  std::string text;
  for (const std::string& damage : {report.damage, report.catalogue_damage})
    if (!damage.empty()) absl::StrAppend(&text, "directory: ", verdict(damage), "\n");
  for (const SceneReport& scene : report.scenes)
    absl::StrAppend(&text, "scene ", scene.name, ": ", verdict(scene.damage), " (snapshot to record ",
                    scene.snapshot_sequence, ", ", scene.snapshot_bytes, " bytes; log to record ", scene.last_sequence,
                    ", ", scene.log_bytes, " bytes)\n");
  for (const MeshReport& mesh : report.meshes)
    absl::StrAppend(&text, "mesh ", mesh.name, ": ", verdict(mesh.damage), " (", mesh.bytes, " bytes)\n");
  absl::StrAppend(&text, report.scenes.size(), " scenes, ", report.meshes.size(), " meshes, ",
                  report.closed_in_order ? "closed in order" : "not closed in order", ": ",
                  report.intact() ? "all is intact" : "NOT all is intact: run `locusd repair`, or restore a backup",
                  "\n");
  return text;
}

}  // namespace locus::server
