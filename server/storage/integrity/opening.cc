#include "server/storage/integrity/opening.h"

#include <algorithm>
#include <filesystem>
#include <utility>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/base/check.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "server/storage/rocksdb/errors.h"
#include "server/storage/rocksdb/reading.h"
#include "server/storage/rows/row_codec.h"

namespace locus::server {
namespace {

constexpr uint64_t kMaxReserve = uint64_t{64} << 20;
constexpr uint64_t kReserveShare = 20;
constexpr uint64_t kBufferShare = 16;
constexpr uint64_t kMinBuffer = uint64_t{256} << 10;

absl::Status unopenable(const StorageOptions& options, absl::string_view why) {
  return absl::DataLossError(
      absl::StrCat("the data directory ", options.path, " cannot be opened: ", why, repair_hint(options.path)));
}

absl::Status open_error(const StorageOptions& options, const rocksdb::Status& status) {
  if (is_damage(status)) return unopenable(options, status.ToString());
  return disk_error(absl::StrCat("opening ", options.path), status);
}

std::vector<std::string> files_in(rocksdb::Env& env, const std::string& folder) {
  std::vector<std::string> names;
  if (!env.GetChildren(folder, &names).ok()) names.clear();
  return names;
}

// Syncs RocksDB's log files. A killed process may have left records in the page cache only. This process will read and
// serve such records, so they must be on the disk first.
rocksdb::Status sync_logs(rocksdb::Env& env, const std::string& folder) {
  rocksdb::Status status;
  for (const std::string& name : files_in(env, folder)) {
    if (!status.ok() || !absl::EndsWith(name, ".log")) continue;
    std::unique_ptr<rocksdb::RandomRWFile> file;
    status = env.NewRandomRWFile(absl::StrCat(folder, "/", name), &file, rocksdb::EnvOptions());
    if (status.ok()) status = file->Fsync();
  }
  if (status.ok()) status = sync_folder(env, folder);
  return status;
}

absl::Status make_folder(rocksdb::Env& env, const std::string& path) {
  rocksdb::Status status = env.CreateDirIfMissing(path);
  const std::string parent = std::filesystem::path(path).parent_path().string();
  if (status.ok()) status = sync_folder(env, parent.empty() ? "." : parent);
  return status.ok() ? absl::OkStatus() : disk_error(absl::StrCat("making the data directory ", path), status);
}

// Returns whether the directory has no database, or a database whose creation was interrupted.
absl::StatusOr<bool> is_new(const StorageOptions& options, const absl::StatusOr<DurableMarker>& durable_marker) {
  if (durable_marker.ok()) return durable_marker->catalogue == 0;
  if (!absl::IsNotFound(durable_marker.status())) return false;
  const std::string folder = database_options_of(options).folder;
  for (const std::string& name : files_in(*options.env, folder)) {
    if (name != "." && name != "..") return false;
  }
  return true;
}

absl::Status create_database(const StorageOptions& options, OpenedDirectory& opened) {
  // Write a marker of generation 0 first. If the creation of the database is interrupted, the next opening creates the
  // database again.
  RETURN_IF_ERROR(opened.durable_marker_file->replace(opened.durable_marker));
  const DatabaseOptions wanted = database_options_of(options);
  rocksdb::Status status = Database::open(wanted, OpenMode::kCreate, opened.database);
  if (!status.ok()) return open_error(options, status);
  Database& database = *opened.database;
  const Catalogue catalogue(Catalogue::Rows(), 0, 1);
  rocksdb::WriteBatch batch;
  status = batch.Put(database.meta(), slice_of(kFormatKey), with_checksum(kFormatKey, RowWriter().u32(kFormat).view()));
  if (!status.ok()) return disk_error("the format", status);
  catalogue.add_to(batch, database.meta(), CatalogueChange());
  RETURN_IF_ERROR(database.write(batch, true));
  opened.durable_marker.catalogue = 1;
  describe_file_list(database, opened.durable_marker);
  return opened.durable_marker_file->replace(opened.durable_marker);
}

// Copies `damage_report` into the durable marker, so that the next opening reports the damage too.
void record_damage(const DamageReport& damage_report, DurableMarker& durable_marker) {
  std::vector<SceneMarker> scene_markers;
  for (const SceneHealth& scene : damage_report.scenes) {
    SceneMarker& scene_marker = scene_markers.emplace_back();
    for (const SceneMarker& before : durable_marker.scene_markers) {
      if (before.scene == scene.key) scene_marker = before;
    }
    scene_marker.scene = scene.key;
    scene_marker.name = scene.name;
    scene_marker.damage = scene.damage;
    durable_marker.next_scene = std::max(durable_marker.next_scene, scene.key + 1);
  }
  durable_marker.scene_markers = std::move(scene_markers);
  durable_marker.catalogue_damage = damage_report.catalogue_damage;
  if (damage_report.catalogue) {
    durable_marker.next_scene = std::max(durable_marker.next_scene, damage_report.catalogue->next_scene);
    durable_marker.catalogue = std::max(durable_marker.catalogue, damage_report.catalogue->generation);
  }
  durable_marker.catalogue = std::max<uint64_t>(durable_marker.catalogue, 1);
}

bool is_intact(const DamageReport& damage_report) {
  return damage_report.catalogue_damage.empty() &&
         std::all_of(damage_report.scenes.begin(), damage_report.scenes.end(),
                     [](const SceneHealth& scene) { return scene.damage.empty(); });
}

// Verifies the database; if it is damaged, writes the damage into the durable marker before any other file changes.
absl::Status verify_and_record(const Database& database, const DurableMarker* expected, OpenedDirectory& opened) {
  ASSIGN_OR_RETURN(DamageReport damage_report, verify(database, expected, Depth::kKeys));
  opened.damage_report = std::move(damage_report);
  if (is_intact(opened.damage_report)) return absl::OkStatus();
  record_damage(opened.damage_report, opened.durable_marker);
  return opened.durable_marker_file->replace(opened.durable_marker);
}

// Opens a database that OpenMode::kStrict refused with the status `why`. First opens it read-only, verifies it and
// records the damage in the durable marker; then opens it with OpenMode::kLenient, which deletes the unreadable parts.
absl::Status open_damaged(const StorageOptions& options, const rocksdb::Status& why, const DurableMarker* expected,
                          OpenedDirectory& opened) {
  const DatabaseOptions wanted = database_options_of(options);
  {
    std::unique_ptr<Database> reader;
    if (!Database::open(wanted, OpenMode::kReadOnlyLenient, reader).ok()) return unopenable(options, why.ToString());
    RETURN_IF_ERROR(verify_and_record(*reader, expected, opened));
  }
  rocksdb::Status status = Database::open(wanted, OpenMode::kLenient, opened.database);
  if (!status.ok()) return unopenable(options, status.ToString());
  // The lenient opening has removed a damaged log, so a strict opening may succeed now. Prefer a strict opening:
  // RocksDB then refuses writes after a disk error until recover() has resumed the database.
  opened.database = nullptr;
  if (Database::open(wanted, OpenMode::kStrict, opened.database).ok()) return absl::OkStatus();
  status = Database::open(wanted, OpenMode::kLenient, opened.database);
  return status.ok() ? absl::OkStatus() : unopenable(options, status.ToString());
}

}  // namespace

absl::StatusOr<std::unique_ptr<DirectoryLock>> DirectoryLock::acquire(rocksdb::Env& env, const std::string& path) {
  rocksdb::FileLock* lock = nullptr;
  const rocksdb::Status status = env.LockFile(absl::StrCat(path, "/", kName), &lock);
  if (status.ok()) return std::unique_ptr<DirectoryLock>(new DirectoryLock(env, lock));
  const std::string message = status.ToString();
  // RocksDB's messages: the first if another process holds the lock, the second if this process holds the lock.
  if (absl::StrContains(message, "Resource temporarily unavailable") || absl::StrContains(message, "lock hold")) {
    Refusal refusal;
    refusal.reason = Reason::kInUse;
    return refuse(absl::StatusCode::kFailedPrecondition,
                  absl::StrCat("the data directory ", path,
                               " is in use: stop the locusd that has it open, or name another (", message, ")"),
                  refusal);
  }
  return disk_error(absl::StrCat("locking the data directory ", path), status);
}

DirectoryLock::~DirectoryLock() { env_.UnlockFile(lock_).PermitUncheckedError(); }

StorageOptions with_defaults(StorageOptions options) {
  if (options.env == nullptr) options.env = rocksdb::Env::Default();
  // If the directory is missing, measure the disk of its nearest existing parent.
  std::error_code failed;
  std::filesystem::path parent = std::filesystem::absolute(options.path, failed);
  while (!std::filesystem::exists(parent, failed) && parent.has_relative_path()) parent = parent.parent_path();
  const std::filesystem::space_info space = std::filesystem::space(parent, failed);
  const uint64_t capacity = failed ? ~uint64_t{0} : uint64_t{space.capacity};
  if (!options.reserve_bytes) options.reserve_bytes = std::min(kMaxReserve, capacity / kReserveShare);
  options.log_buffer_bytes = std::max(kMinBuffer, std::min(options.log_buffer_bytes, capacity / kBufferShare));
  return options;
}

DatabaseOptions database_options_of(const StorageOptions& options) {
  return {options.env, absl::StrCat(options.path, "/", kDatabaseFolder), options.log_buffer_bytes, options.warn};
}

absl::StatusOr<OpenedDirectory> open_directory(const StorageOptions& options) {
  LOCUS_DCHECK(options.env != nullptr && options.reserve_bytes.has_value());
  OpenedDirectory opened;
  RETURN_IF_ERROR(make_folder(*options.env, options.path));
  ASSIGN_OR_RETURN(opened.lock, DirectoryLock::acquire(*options.env, options.path));
  const std::string repaired = absl::StrCat(options.path, "/", kRepairedFolder);
  if (options.env->FileExists(repaired).ok())
    return absl::FailedPreconditionError(
        absl::StrCat("a repair of ", options.path, " was interrupted: run `locusd repair ", options.path, "` again"));
  opened.durable_marker_file = std::make_unique<DurableMarkerFile>(*options.env, options.path);
  absl::StatusOr<DurableMarker> durable_marker = DurableMarkerFile::read(*options.env, options.path);
  if (absl::IsUnavailable(durable_marker.status())) return durable_marker.status();
  const absl::StatusOr<bool> fresh = is_new(options, durable_marker);
  if (durable_marker.ok()) opened.durable_marker = *durable_marker;
  const DurableMarker* expected = durable_marker.ok() ? &*durable_marker : nullptr;
  if (*fresh) {
    RETURN_IF_ERROR(create_database(options, opened));
    durable_marker = opened.durable_marker;
    expected = &*durable_marker;
  } else {
    const DatabaseOptions wanted = database_options_of(options);
    if (expected != nullptr) {
      const absl::Status list = check_file_list(*options.env, wanted.folder, *expected);
      if (absl::IsDataLoss(list)) return unopenable(options, list.message());
      RETURN_IF_ERROR(list);
    }
    rocksdb::Status status = sync_logs(*options.env, wanted.folder);
    if (status.ok()) status = Database::open(wanted, OpenMode::kStrict, opened.database);
    if (!status.ok()) {
      if (!is_damage(status)) return open_error(options, status);
      RETURN_IF_ERROR(open_damaged(options, status, expected, opened));
      expected = &opened.durable_marker;
    }
  }
  RETURN_IF_ERROR(verify_and_record(*opened.database, expected, opened));
  if (!opened.damage_report.has_format) return unopenable(options, "its catalogue is lost");
  return opened;
}

absl::Status check_file_list(rocksdb::Env& env, const std::string& database_folder,
                             const DurableMarker& durable_marker) {
  std::string current;
  const rocksdb::Status status = rocksdb::ReadFileToString(&env, absl::StrCat(database_folder, "/CURRENT"), &current);
  if (status.IsNotFound() || status.IsPathNotFound()) return absl::DataLossError("its database is missing");
  if (!status.ok()) return disk_error("reading CURRENT", status);
  current = std::string(absl::StripSuffix(current, "\n"));
  if (current != durable_marker.manifest) return absl::OkStatus();
  uint64_t size = 0;
  if (!env.GetFileSize(absl::StrCat(database_folder, "/", current), &size).ok() || size < durable_marker.manifest_bytes)
    return absl::DataLossError(absl::StrCat("RocksDB's list of its files, ", current, ", has ", size, " of ",
                                            durable_marker.manifest_bytes, " bytes"));
  return absl::OkStatus();
}

void describe_file_list(const Database& database, DurableMarker& durable_marker) {
  std::vector<std::string> names;
  uint64_t bytes = 0;
  if (!database.db().GetLiveFiles(names, &bytes, false).ok()) return;
  for (const std::string& name : names) {
    const absl::string_view plain = absl::StripPrefix(name, "/");
    if (!absl::StartsWith(plain, "MANIFEST")) continue;
    durable_marker.manifest = std::string(plain);
    durable_marker.manifest_bytes = bytes;
  }
}

}  // namespace locus::server
