#include "server/storage/integrity/repair.h"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/status_macros.h"
#include "server/storage/integrity/opening.h"
#include "server/storage/integrity/scene_table.h"
#include "server/storage/rocksdb/errors.h"
#include "server/storage/rocksdb/reading.h"
#include "server/storage/rows/row_codec.h"

namespace locus::server {
namespace {

namespace fs = std::filesystem;

constexpr absl::string_view kReadyName = "READY";
constexpr absl::string_view kSalvageFolder = "salvage";
constexpr size_t kBatchBytes = size_t{4} << 20;

absl::Status move_if_exists(const fs::path& from, const fs::path& to) {
  std::error_code failed;
  if (fs::exists(from)) fs::rename(from, to, failed);
  return failed ? absl::UnavailableError(absl::StrCat("moving ", from.string(), ": ", failed.message()))
                : absl::OkStatus();
}

// Writer of rows, records and chunks into the new database, in batches of about kBatchBytes.
class Copier {
 public:
  Copier(Database& target, ProgressWriter* progress) : target_(target), progress_(progress) {}

  void put(rocksdb::ColumnFamilyHandle* family, const std::string& key, const std::string& value) {
    LOCUS_CHECK(batch_.Put(family, key, value).ok());
    bytes_ += value.size();
    if (progress_ != nullptr) progress_->update(bytes_);
  }
  absl::Status write_if_large() { return batch_.GetDataSize() < kBatchBytes ? absl::OkStatus() : write(false); }
  absl::Status write(bool sync) {
    absl::Status status = target_.write(batch_, sync);
    batch_.Clear();
    return status;
  }
  Database& target() { return target_; }
  rocksdb::WriteBatch& batch() { return batch_; }

 private:
  Database& target_;
  rocksdb::WriteBatch batch_;
  ProgressWriter* const progress_;
  uint64_t bytes_ = 0;  // bytes of all values
};

absl::Status copy_chunks(const Database& source, rocksdb::ColumnFamilyHandle* from, rocksdb::ColumnFamilyHandle* to,
                         const std::string& prefix, const ChunkList& list, Copier& copier) {
  uint32_t index = 0;
  return read_chunks(source, from, prefix, list, [&](absl::string_view chunk) {
    const std::string key = chunk_key(prefix, index++);
    copier.put(to, key, with_checksum(key, chunk));
    return copier.write_if_large();
  });
}

// Copies the scene's records before the first damaged or missing record. Stores the position of the last copied record
// in `last`.
absl::Status copy_records(const Database& source, const SceneRow& row, Position& last, Copier& copier) {
  absl::Status failed;
  last = {row.snapshot_sequence, row.running_checksum};
  const absl::Status read =
      read_records(source, row.key, row.snapshot_sequence + 1, 0, row.running_checksum, [&](const LogRecord& record) {
        const std::string key = log_key(row.key, record.sequence);
        const std::string head = record_head(record.entry);
        last = {record.sequence, record_checksum(key, head, record.entry.bytes, last.running_checksum)};
        copier.put(copier.target().log(), key,
                   absl::StrCat(head, record.entry.bytes, RowWriter().u64(last.running_checksum).view()));
        failed = copier.write_if_large();
        return failed;
      });
  RETURN_IF_ERROR(failed);
  return absl::IsDataLoss(read) ? absl::OkStatus() : read;
}

// Catalogue rows and durable marker of the new data directory.
struct Result {
  Catalogue::Rows rows;
  DurableMarker durable_marker;
};

void put_row(const std::string& key, const std::string& value, Result& result, Copier& copier) {
  result.rows[key] = value;
  copier.put(copier.target().meta(), key, value);
}

absl::Status copy_scene(const Database& source, const SceneHealth& found, const DurableMarker* expected, Copier& copier,
                        Result& result, RepairReport& report) {
  SceneRepair repaired;
  repaired.key = found.key;
  repaired.name = found.name;
  repaired.damage = found.damage;
  bool marked = expected == nullptr;
  if (expected != nullptr) {
    for (const SceneMarker& scene_marker : expected->scene_markers) marked = marked || scene_marker.scene == found.key;
  }
  const bool damaged = !found.damage.empty();
  repaired.deleted = damaged && !marked && expected->catalogue_damage.empty();
  repaired.dropped = !found.row || repaired.deleted;
  Position last;
  if (!repaired.dropped) {
    const SceneRow& row = *found.row;
    const absl::Status chunks = copy_chunks(source, source.snapshot(), copier.target().snapshot(),
                                            snapshot_prefix(row.key, row.snapshot_id), row.snapshot, copier);
    if (!chunks.ok() && !absl::IsDataLoss(chunks)) return chunks;
    repaired.dropped = !chunks.ok();
  }
  if (!repaired.dropped) {
    SceneRow row = *found.row;
    RETURN_IF_ERROR(copy_records(source, row, last, copier));
    if (damaged) ++row.epoch;
    const std::string key = scene_key(row.key);
    const std::string value = with_checksum(key, encode(row));
    put_row(key, value, result, copier);
    result.durable_marker.scene_markers.push_back({row.key, row.name, last.sequence, last.running_checksum,
                                                   stored_checksum(value), found.copied && !damaged, ""});
    repaired.epoch = row.epoch;
    repaired.kept_to = last.sequence;
  }
  if (!repaired.deleted && last.sequence < found.expected_sequence) {
    repaired.lost_from = last.sequence + 1;
    repaired.lost_to = found.expected_sequence;
  }
  if (damaged) report.scenes.push_back(std::move(repaired));
  return absl::OkStatus();
}

// Copies chunks of a mesh. If a chunk is damaged, returns DATA_LOSS and deletes the chunks that were already copied.
absl::Status copy_mesh_chunks(const Database& source, const Sha256& sha256, const ContentRow& row, Copier& copier) {
  rocksdb::ColumnFamilyHandle* const to = copier.target().mesh();
  const std::string prefix = mesh_prefix(sha256, row.content_id);
  absl::Status status = copy_chunks(source, source.mesh(), to, prefix, row.chunks, copier);
  if (absl::IsDataLoss(status)) LOCUS_CHECK(copier.batch().DeleteRange(to, prefix, end_of(prefix)).ok());
  return status;
}

absl::Status copy_mesh(const Database& source, const MeshHealth& found, Copier& copier, Result& result,
                       RepairReport& report) {
  const std::string content = content_key(found.sha256);
  absl::Status status = absl::DataLossError("");
  if (result.rows.contains(content)) {
    status = absl::OkStatus();
  } else if (found.content.content_id != 0) {
    status = copy_mesh_chunks(source, found.sha256, found.content, copier);
  }
  if (!status.ok() && !absl::IsDataLoss(status)) return status;
  MeshRepair repaired{found.name, found.damage, !status.ok(), false};
  if (status.ok()) {
    MeshRow row{found.sha256, found.parts, found.grace_s};
    absl::Status parts = row.parts ? copy_mesh_chunks(source, row.sha256, *row.parts, copier) : absl::OkStatus();
    if (!parts.ok() && !absl::IsDataLoss(parts)) return parts;
    repaired.parts_dropped = !parts.ok();
    // If the chunks of the parts are damaged, write the row without `parts`. For such a row, as for a row of format 1,
    // readers expect the parts among the chunks of the content. They find none there, so the mesh then has no parts.
    if (repaired.parts_dropped) row.parts = std::nullopt;
    put_row(content, with_checksum(content, encode(found.content)), result, copier);
    const std::string key = mesh_key(found.name);
    put_row(key, with_checksum(key, encode(row)), result, copier);
  }
  if (!found.damage.empty()) report.meshes.push_back(std::move(repaired));
  return absl::OkStatus();
}

absl::Status make_copy(const Database& source, const DamageReport& damage_report, const DurableMarker* expected,
                       const StorageOptions& options, const std::string& folder, RepairReport& report,
                       ProgressWriter* progress) {
  if (progress != nullptr) progress->begin({.action = "copying", .subject = "the intact part", .unit = kProgressBytes});
  DatabaseOptions wanted = database_options_of(options);
  wanted.folder = absl::StrCat(folder, "/", kDatabaseFolder);
  std::unique_ptr<Database> target;
  rocksdb::Status opened = options.env->CreateDirIfMissing(folder);
  if (opened.ok()) opened = Database::open(wanted, OpenMode::kCreate, target);
  if (!opened.ok()) return disk_error("making the repaired database", opened);
  Copier copier(*target, progress);
  Result result;
  DurableMarker& durable_marker = result.durable_marker;
  if (expected != nullptr) durable_marker.next_scene = expected->next_scene;
  for (const SceneHealth& scene : damage_report.scenes) {
    durable_marker.next_scene = std::max(durable_marker.next_scene, scene.key + 1);
    RETURN_IF_ERROR(copy_scene(source, scene, expected, copier, result, report));
  }
  for (const MeshHealth& mesh : damage_report.meshes) {
    RETURN_IF_ERROR(copy_mesh(source, mesh, copier, result, report));
  }
  const uint64_t generation = std::max(expected == nullptr ? 0 : expected->catalogue,
                                       damage_report.catalogue ? damage_report.catalogue->generation : 0);
  const Catalogue catalogue(result.rows, generation, durable_marker.next_scene);
  copier.put(target->meta(), std::string(kFormatKey), with_checksum(kFormatKey, RowWriter().u32(kFormat).view()));
  catalogue.add_to(copier.batch(), target->meta(), CatalogueChange());
  RETURN_IF_ERROR(copier.write(true));
  durable_marker.catalogue = generation + 1;
  durable_marker.mesh_sum = catalogue.totals().mesh_sum;
  durable_marker.closed = true;
  durable_marker.flushed_sequence = target->db().GetLatestSequenceNumber();
  describe_file_list(*target, durable_marker);
  return DurableMarkerFile(*options.env, folder).replace(durable_marker);
}

// Moves the old database and marker into the folder before-repair-N, and the new database and marker from repaired/
// into the data directory. Precondition: repaired/READY, which contains the path of before-repair-N, exists. Writing
// READY is the commit point of a repair: after a later crash, the next call of repair() first does the moves that are
// still missing.
absl::Status install_repaired(const StorageOptions& options, std::string& kept_at) {
  rocksdb::Env& env = *options.env;
  const fs::path here = options.path;
  const fs::path repaired = here / std::string(kRepairedFolder);
  const fs::path ready = repaired / std::string(kReadyName);
  rocksdb::Status status = rocksdb::ReadFileToString(&env, ready.string(), &kept_at);
  // The path in READY may be relative to another working directory.
  kept_at = (here / fs::path(kept_at).filename()).string();
  if (status.ok()) status = env.CreateDirIfMissing(kept_at);
  if (!status.ok()) return disk_error("finishing the repair", status);
  for (const absl::string_view name : {kDatabaseFolder, DurableMarkerFile::kName}) {
    const std::string part(name);
    if (!fs::exists(repaired / part)) continue;  // moved by an earlier, interrupted call
    absl::Status done = move_if_exists(here / part, fs::path(kept_at) / part);
    if (done.ok()) done = move_if_exists(repaired / part, here / part);
    RETURN_IF_ERROR(done);
  }
  status = sync_folder(env, kept_at);
  if (status.ok()) status = sync_folder(env, here.string());
  if (status.ok()) {
    std::error_code failed;
    fs::remove_all(repaired, failed);
    if (failed) return absl::UnavailableError(absl::StrCat("removing ", repaired.string(), ": ", failed.message()));
    status = sync_folder(env, here.string());
  }
  return status.ok() ? absl::OkStatus() : disk_error("finishing the repair", status);
}

std::string next_backup_folder(const std::string& path) {
  for (int index = 1;; ++index) {
    std::string name = absl::StrCat(path, "/before-repair-", index);
    if (!fs::exists(name)) return name;
  }
}

// Salvages a database that cannot be opened in any mode: copies it and runs rocksdb::RepairDB() on the copy.
absl::Status open_salvage(const StorageOptions& options, const std::string& folder,
                          std::unique_ptr<Database>& database) {
  DatabaseOptions wanted = database_options_of(options);
  std::error_code failed;
  fs::create_directories(folder, failed);
  const std::string copy = absl::StrCat(folder, "/", kSalvageFolder);
  if (!failed) fs::copy(wanted.folder, copy, fs::copy_options::recursive, failed);
  if (failed) return absl::UnavailableError(absl::StrCat("copying ", wanted.folder, ": ", failed.message()));
  wanted.folder = copy;
  rocksdb::Status status =
      rocksdb::RepairDB(copy, database_options(wanted, OpenMode::kLenient), families(wanted, OpenMode::kLenient));
  if (status.ok()) status = Database::open(wanted, OpenMode::kReadOnlyLenient, database);
  if (status.ok()) return absl::OkStatus();
  return absl::DataLossError(
      absl::StrCat("no part of ", options.path, " can be read (", status.ToString(), "): restore a backup"));
}

absl::StatusOr<std::unique_ptr<Database>> open_source(const StorageOptions& options, const DurableMarker* expected,
                                                      const std::string& folder) {
  const DatabaseOptions wanted = database_options_of(options);
  std::unique_ptr<Database> database;
  const bool file_list_intact = expected == nullptr || check_file_list(*options.env, wanted.folder, *expected).ok();
  if (file_list_intact && Database::open(wanted, OpenMode::kReadOnly, database).ok()) return database;
  if (file_list_intact && Database::open(wanted, OpenMode::kReadOnlyLenient, database).ok()) return database;
  RETURN_IF_ERROR(open_salvage(options, folder, database));
  return database;
}

// Verifies the database and writes its intact parts to `folder`. If the database could be opened and is intact, writes
// nothing, and `folder` does not exist afterwards. Sets report.found.
absl::Status verify_and_copy(const StorageOptions& options, const DurableMarker* expected, const std::string& folder,
                             RepairReport& report, ProgressWriter* progress) {
  if (progress != nullptr) progress->begin({.action = "opening", .subject = options.path});
  ASSIGN_OR_RETURN(const auto source, open_source(options, expected, folder));
  if (progress != nullptr) progress->begin({.action = "checking", .subject = options.path, .unit = kProgressBytes});
  ASSIGN_OR_RETURN(const DamageReport damage_report, verify(*source, expected, Depth::kEverything, progress));
  report.found = report_of(damage_report);
  if (report.found.intact() && !fs::exists(folder)) return absl::OkStatus();
  return make_copy(*source, damage_report, expected, options, folder, report, progress);
}

std::string outcome_of(const SceneRepair& scene) {
  if (scene.deleted) return "had been deleted and is deleted again: nothing is lost";
  if (scene.dropped) return "LOST: no part of it could be kept";
  const std::string kept = absl::StrCat("kept up to record ", scene.kept_to, ", with a new epoch");
  if (scene.lost_from == 0) return absl::StrCat(kept, "; no lost record is known");
  return absl::StrCat(kept, "; LOST: records ", scene.lost_from, " to ", scene.lost_to);
}

std::string outcome_of(const MeshRepair& mesh) {
  if (mesh.dropped) return "LOST";
  return mesh.parts_dropped ? "kept; LOST: the names of its parts" : "kept";
}

}  // namespace

absl::StatusOr<RepairReport> repair(const StorageOptions& given, ProgressWriter* progress) {
  const StorageOptions options = with_defaults(given);
  const std::string folder = absl::StrCat(options.path, "/", kRepairedFolder);
  RepairReport report;
  if (!fs::exists(options.path)) return absl::NotFoundError(absl::StrCat(options.path, " is no data directory"));
  ASSIGN_OR_RETURN(const auto lock, DirectoryLock::acquire(*options.env, options.path));
  std::error_code failed;
  // READY is empty if the machine lost power while it was written: then the repair was not committed.
  const uint64_t ready_bytes = fs::file_size(absl::StrCat(folder, "/", kReadyName), failed);
  if (!failed && ready_bytes > 0) RETURN_IF_ERROR(install_repaired(options, report.finished_at));
  fs::remove_all(folder, failed);
  const absl::StatusOr<DurableMarker> durable_marker = DurableMarkerFile::read(*options.env, options.path);
  const DurableMarker* expected = durable_marker.ok() ? &*durable_marker : nullptr;
  if (absl::Status copied = verify_and_copy(options, expected, folder, report, progress); !copied.ok()) {
    fs::remove_all(folder, failed);
    return copied;
  }
  if (!fs::exists(folder)) return report;
  fs::remove_all(absl::StrCat(folder, "/", kSalvageFolder), failed);
  rocksdb::Status status = sync_folder(*options.env, folder);
  if (status.ok())
    status = rocksdb::WriteStringToFile(options.env, next_backup_folder(options.path),
                                        absl::StrCat(folder, "/", kReadyName), true);
  if (status.ok()) status = sync_folder(*options.env, folder);
  if (!status.ok()) return disk_error("writing the repaired database", status);
  report.changed = true;
  RETURN_IF_ERROR(install_repaired(options, report.kept_at));
  return report;
}

std::string to_text(const RepairReport& report) {
  std::string text;
  if (!report.finished_at.empty())
    absl::StrAppend(&text, "finished a repair that was interrupted; the database before it is in ", report.finished_at,
                    ": run `locusd check` on a copy to see what was damaged\n");
  if (!report.changed) return absl::StrCat(text, text.empty() ? "all is intact: no file was changed\n" : "");
  for (const SceneRepair& scene : report.scenes)
    absl::StrAppend(&text, "scene ", scene.name, ": ", scene.damage, "; ", outcome_of(scene), "\n");
  for (const MeshRepair& mesh : report.meshes)
    absl::StrAppend(&text, "mesh ", mesh.name, ": ", mesh.damage, "; ", outcome_of(mesh), "\n");
  absl::StrAppend(&text, "the old database is in ", report.kept_at, "; remove it when it is no longer needed\n");
  return text;
}

}  // namespace locus::server
