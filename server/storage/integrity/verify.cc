#include "server/storage/integrity/verify.h"

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/storage/rocksdb/errors.h"
#include "server/storage/rocksdb/reading.h"
#include "server/storage/rows/row_codec.h"

namespace locus::server {
namespace {

constexpr absl::string_view kNoMarker = "HIGH_WATER is missing or unreadable, so lost records cannot be detected";

// Result of comparing the catalogue in the database with the durable marker.
struct CatalogueState {
  bool intact = false;  // the catalogue is not older than the marker, and its rows match the sums stored in it
  bool newer = false;   // the catalogue was changed after the marker was written
  // The mesh rows match the mesh sum that is stored in the catalogue or in the marker, whichever is newer.
  bool meshes_intact = false;
};

std::string count_of(uint64_t count, absl::string_view thing) {
  return absl::StrCat(count, " ", thing, count == 1 ? "" : "s");
}

absl::Status read_meta(const Database& database, DamageReport& found) {
  const std::unique_ptr<rocksdb::Iterator> at(database.db().NewIterator(reading_options(), database.meta()));
  for (at->SeekToFirst(); at->Valid(); at->Next()) {
    const absl::string_view key = view_of(at->key());
    const std::optional<absl::string_view> bytes = verified(key, view_of(at->value()));
    if (!bytes || key == kFamilyMark) continue;
    if (key == kFormatKey) {
      const uint32_t format = RowReader(*bytes).u32();
      if (format < kOldestFormat || format > kFormat)
        return absl::FailedPreconditionError(absl::StrCat("the data directory has format ", format,
                                                          ", of another version of locusd; this one knows formats ",
                                                          kOldestFormat, " to ", kFormat));
      found.has_format = true;
      found.format = format;
    } else if (key == kCatalogueKey) {
      found.catalogue = decode_catalogue(*bytes);
    } else if (key[0] == kPendingSnapshotTag || key[0] == kPendingMeshTag) {
      found.pending.emplace_back(key);
    } else {
      found.rows.emplace(key, view_of(at->value()));
    }
  }
  // Rows after an unreadable block count as lost. The caller detects the loss, because the remaining rows do not match
  // the catalogue's sums or the durable marker.
  if (at->status().ok() || is_damage(at->status())) return absl::OkStatus();
  return read_error("reading the catalogue", at->status());
}

CatalogueState compare(const DamageReport& found, const DurableMarker& expected) {
  CatalogueRow sums;
  Catalogue::add_sums(found.rows, sums);
  const CatalogueRow stored = found.catalogue.value_or(CatalogueRow());
  CatalogueState catalogue;
  catalogue.newer = stored.generation > expected.catalogue;
  catalogue.intact =
      stored.generation >= expected.catalogue && stored.scene_sum == sums.scene_sum && stored.mesh_sum == sums.mesh_sum;
  catalogue.meshes_intact = sums.mesh_sum == (catalogue.newer ? stored.mesh_sum : expected.mesh_sum);
  return catalogue;
}

// Returns a description of the damage of the scene's row; empty if the row is intact.
std::string row_damage(const SceneHealth& scene, const SceneMarker* scene_marker, const CatalogueState& catalogue) {
  if (catalogue.intact && catalogue.newer) return "";
  if (scene_marker == nullptr)
    return catalogue.intact ? "it was deleted, but its entry in the catalogue is back"
                            : "HIGH_WATER does not name it, and the catalogue is damaged";
  if (!scene.row) return "its entry in the catalogue is lost";
  if (scene_marker->row_checksum != scene.row_checksum) return "its entry in the catalogue is not the latest one";
  return "";
}

// Returns the message of `status`, an empty text for OK. If `status` is an error of the disk rather than damage, also
// stores `status` in `disk`.
std::string damage_of(const absl::Status& status, absl::Status& disk) {
  if (!status.ok() && !absl::IsDataLoss(status)) disk.Update(status);
  return std::string(status.message());
}

std::string log_damage(SceneHealth& scene, const SceneMarker* scene_marker, const DurableMarker& expected,
                       const Database& database, absl::Status& disk) {
  const SceneRow& row = *scene.row;
  uint64_t marked_checksum = 0;
  const bool marked = scene_marker != nullptr && scene_marker->sequence >= row.snapshot_sequence;
  if (marked) scene.expected_sequence = scene_marker->sequence;
  const RecordScan scan = scan_records(database, row, scene.expected_sequence, marked_checksum);
  scene.last = scan.last;
  scene.running_checksum = scan.running_checksum;
  scene.log_bytes = scan.bytes;
  if (!scan.error.ok()) return damage_of(scan.error, disk);
  if (scan.first_after_gap != 0)
    return absl::StrCat("missing: ", count_of(scan.first_after_gap - scan.last - 1, "record"), " from ", scan.last + 1,
                        " on, followed by ", count_of(scan.count_after_gap, "other"));
  if (scan.last < scene.expected_sequence)
    return absl::StrCat("missing: the last ", count_of(scene.expected_sequence - scan.last, "acknowledged record"),
                        ", from ", scan.last + 1, " on");
  if (marked && marked_checksum != scene_marker->running_checksum)
    return absl::StrCat("record ", scene_marker->sequence, " does not match the checksum in HIGH_WATER");
  const uint64_t gap_end = database.wal_watch().gap_end();
  if (gap_end > expected.flushed_sequence && !expected.closed && !database.wal_watch().has_records_after_gap(scene.key))
    return absl::StrCat("part of the log is unreadable, so records after ", scan.last, " may be lost");
  return "";
}

// Counts the bytes that verify() reads, for its progress.
class ReadCounter {
 public:
  explicit ReadCounter(ProgressWriter* progress) : progress_(progress) {}

  // Adds bytes that will be read.
  void expect(uint64_t bytes) { total_ += bytes; }
  void count(size_t bytes) {
    done_ += bytes;
    if (progress_ != nullptr) progress_->update(done_, total_);
  }

 private:
  ProgressWriter* const progress_;
  uint64_t done_ = 0;
  uint64_t total_ = 0;
};

// Reads every byte of the scene's snapshot and records. Returns a description of the damage; empty if all are intact.
std::string deep_damage(const SceneHealth& scene, const Database& database, ReadCounter& counter, absl::Status& disk) {
  const SceneRow& row = *scene.row;
  const auto discard = [&](absl::string_view chunk) {
    counter.count(chunk.size());
    return absl::OkStatus();
  };
  absl::Status status =
      read_chunks(database, database.snapshot(), snapshot_prefix(row.key, row.snapshot_id), row.snapshot, discard);
  if (!status.ok()) return absl::StrCat("its snapshot: ", damage_of(status, disk));
  status = read_records(database, row.key, row.snapshot_sequence + 1, scene.last, row.running_checksum,
                        [&](const LogRecord& record) {
                          counter.count(record.entry.bytes.size());
                          return absl::OkStatus();
                        });
  return damage_of(status, disk);
}

absl::Status verify_scene(SceneHealth& scene, const SceneMarker* scene_marker, const DurableMarker* expected,
                          const CatalogueState& catalogue, const Database& database, Depth depth,
                          ReadCounter& counter) {
  absl::Status disk;
  if (scene_marker != nullptr) scene.expected_sequence = scene_marker->sequence;
  scene.copied = scene_marker != nullptr && scene_marker->copied;
  scene.damage = scene_marker != nullptr ? scene_marker->damage : "";
  std::string damage = expected == nullptr ? std::string(kNoMarker) : row_damage(scene, scene_marker, catalogue);
  // Scan the log of a damaged scene too, because the report contains its sequence numbers.
  if (scene.row) {
    std::string log =
        log_damage(scene, scene_marker, expected == nullptr ? DurableMarker() : *expected, database, disk);
    if (damage.empty()) damage = std::move(log);
    if (damage.empty() && depth == Depth::kEverything) {
      counter.expect(scene.log_bytes);
      damage = deep_damage(scene, database, counter, disk);
    }
  }
  if (scene.damage.empty()) scene.damage = std::move(damage);
  return disk;
}

absl::Status find_scenes(const DurableMarker* expected, const CatalogueState& catalogue, const Database& database,
                         Depth depth, ReadCounter& counter, DamageReport& found) {
  std::map<SceneKey, SceneHealth> scenes;
  std::map<SceneKey, const SceneMarker*> scene_markers;
  for (const auto& [key, value] : found.rows) {
    if (key[0] != kSceneTag) continue;
    std::optional<SceneRow> row = decode_scene(*verified(key, value));
    if (!row) continue;
    SceneHealth& scene = scenes[row->key];
    scene.key = row->key;
    scene.name = row->name;
    scene.row_checksum = stored_checksum(value);
    scene.row = std::move(row);
  }
  if (expected != nullptr) {
    for (const SceneMarker& scene_marker : expected->scene_markers) {
      scene_markers[scene_marker.scene] = &scene_marker;
      if (scenes.contains(scene_marker.scene)) continue;
      // Skip a scene that was deleted after the marker was written.
      if (catalogue.intact && catalogue.newer && scene_marker.damage.empty()) continue;
      SceneHealth& scene = scenes[scene_marker.scene];
      scene.key = scene_marker.scene;
      scene.name = scene_marker.name;
    }
  }
  for (auto& [key, scene] : scenes) {
    const auto scene_marker = scene_markers.find(key);
    RETURN_IF_ERROR(verify_scene(scene, scene_marker == scene_markers.end() ? nullptr : scene_marker->second, expected,
                                 catalogue, database, depth, counter));
    found.scenes.push_back(std::move(scene));
  }
  return absl::OkStatus();
}

absl::Status find_meshes(const Database& database, Depth depth, ReadCounter& counter, DamageReport& found) {
  absl::Status disk;
  const std::string start(1, kMeshTag);
  for (auto row = found.rows.lower_bound(start); row != found.rows.end() && row->first[0] == kMeshTag; ++row) {
    MeshHealth& mesh = found.meshes.emplace_back();
    mesh.name = row->first.substr(1);
    mesh.damage = found.catalogue_damage;
    if (const std::optional<MeshRow> name = decode_mesh(*verified(row->first, row->second))) {
      mesh.sha256 = name->sha256;
      mesh.parts = name->parts;
      mesh.grace_s = name->grace_s;
    }
    const auto content = found.rows.find(content_key(mesh.sha256));
    const std::optional<ContentRow> list =
        content == found.rows.end() ? std::nullopt : decode_content(*verified(content->first, content->second));
    if (list) mesh.content = *list;
    if (!list && mesh.damage.empty()) mesh.damage = "its content is lost";
    if (!mesh.damage.empty() || depth == Depth::kKeys) continue;
    const auto nowhere = [&](absl::string_view chunk) {
      counter.count(chunk.size());
      return absl::OkStatus();
    };
    absl::Status read = read_chunks(database, database.mesh(), mesh_prefix(mesh.sha256, mesh.content.content_id),
                                    mesh.content.chunks, nowhere);
    if (read.ok() && mesh.parts)
      read = read_chunks(database, database.mesh(), mesh_prefix(mesh.sha256, mesh.parts->content_id),
                         mesh.parts->chunks, nowhere);
    mesh.damage = damage_of(read, disk);
  }
  return disk;
}

// Adds to `counter` the bytes of all snapshots and meshes in the catalogue. The bytes of a log are known only after its
// scan.
void expect_rows(const DamageReport& found, ReadCounter& counter) {
  for (const auto& [key, value] : found.rows) {
    if (key[0] == kSceneTag) {
      const std::optional<SceneRow> scene = decode_scene(*verified(key, value));
      if (scene) counter.expect(scene->snapshot.bytes);
    } else if (key[0] == kMeshTag) {
      const std::optional<MeshRow> mesh = decode_mesh(*verified(key, value));
      const auto content = mesh ? found.rows.find(content_key(mesh->sha256)) : found.rows.end();
      if (content == found.rows.end()) continue;
      const std::optional<ContentRow> list = decode_content(*verified(content->first, content->second));
      if (list) counter.expect(list->chunks.bytes);
    }
  }
}

}  // namespace

absl::StatusOr<DamageReport> verify(const Database& database, const DurableMarker* durable_marker, Depth depth,
                                    ProgressWriter* progress) {
  DamageReport found;
  RETURN_IF_ERROR(read_meta(database, found));
  CatalogueState catalogue;
  if (durable_marker != nullptr) catalogue = compare(found, *durable_marker);
  if (durable_marker == nullptr) {
    found.catalogue_damage = std::string(kNoMarker);
  } else if (!durable_marker->catalogue_damage.empty()) {
    found.catalogue_damage = durable_marker->catalogue_damage;
  } else if (!catalogue.meshes_intact) {
    found.catalogue_damage =
        "the catalogue of meshes is not the latest one: names may be missing, or deleted ones may be present";
  } else if (catalogue.newer && !catalogue.intact) {
    found.catalogue_damage =
        "the catalogue of scenes is not the latest one: names may be missing, or deleted ones may be present";
  }
  ReadCounter counter(progress);
  if (progress != nullptr) expect_rows(found, counter);
  absl::Status disk = find_scenes(durable_marker, catalogue, database, depth, counter, found);
  if (disk.ok()) disk = find_meshes(database, depth, counter, found);
  RETURN_IF_ERROR(disk);
  return found;
}

std::string repair_hint(const std::string& path) {
  return absl::StrCat("; `locusd check ", path, "` reports details, `locusd repair ", path,
                      "` keeps the intact part; or restore a backup");
}

}  // namespace locus::server
