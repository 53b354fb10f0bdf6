#include "server/storage/integrity/verify.h"

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/storage/rocksdb/bytes.h"
#include "server/storage/rocksdb/errors.h"
#include "server/storage/rocksdb/reading.h"

namespace locus::server {
namespace {

constexpr absl::string_view kNoHighWater =
    "HIGH_WATER is lost, which says how much must be here, so that nobody knows whether all is";

// How what the database says of its catalogue compares with what it must say.
struct Standing {
  bool whole = false;   // it is of the time of HIGH_WATER or later, and its rows are those it was made of
  bool later = false;   // changes came after HIGH_WATER was written
  bool meshes = false;  // the rows of meshes are those that must be there
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
      const uint32_t format = ByteReader(*bytes).u32();
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
  // What follows a place that cannot be read is as good as lost, and missed below.
  if (at->status().ok() || says_damage(at->status())) return absl::OkStatus();
  return read_error("reading the catalogue", at->status());
}

Standing compare(const DamageReport& found, const DurableMarker& must) {
  CatalogueRow sums;
  Catalogue::add_sums(found.rows, sums);
  const CatalogueRow said = found.catalogue.value_or(CatalogueRow());
  Standing standing;
  standing.later = said.generation > must.catalogue;
  standing.whole =
      said.generation >= must.catalogue && said.scene_sum == sums.scene_sum && said.mesh_sum == sums.mesh_sum;
  standing.meshes = sums.mesh_sum == (standing.later ? said.mesh_sum : must.mesh_sum);
  return standing;
}

// What is wrong with the scene's row, apart from its log.
std::string row_damage(const SceneHealth& scene, const SceneMarker* scene_marker, const Standing& standing) {
  if (standing.whole && standing.later) return "";
  if (scene_marker == nullptr)
    return standing.whole ? "it was deleted, and is back" : "it is not in HIGH_WATER, and the catalogue is not whole";
  if (!scene.row) return "its entry in the catalogue is lost";
  if (scene_marker->row_checksum != scene.row_checksum) return "its entry in the catalogue is of another time";
  return "";
}

// A disk that fails is no damage: that goes into `disk`.
std::string damage_of(const absl::Status& status, absl::Status& disk) {
  if (!status.ok() && !absl::IsDataLoss(status)) disk.Update(status);
  return std::string(status.message());
}

std::string log_damage(SceneHealth& scene, const SceneMarker* scene_marker, const DurableMarker& must,
                       const Database& database, absl::Status& disk) {
  const SceneRow& row = *scene.row;
  uint64_t chain_at = 0;
  const bool marked = scene_marker != nullptr && scene_marker->sequence >= row.snapshot_sequence;
  if (marked) scene.expected_sequence = scene_marker->sequence;
  const RecordScan scan = scan_records(database, row, scene.expected_sequence, chain_at);
  scene.last = scan.last;
  scene.running_checksum = scan.running_checksum;
  scene.log_bytes = scan.bytes;
  if (!scan.error.ok()) return damage_of(scan.error, disk);
  if (scan.beyond != 0)
    return absl::StrCat(count_of(scan.beyond - scan.last - 1, "record"), " from ", scan.last + 1,
                        " on missing, before ", count_of(scan.after, "other"));
  if (scan.last < scene.expected_sequence)
    return absl::StrCat("the last ", count_of(scene.expected_sequence - scan.last, "acknowledged record"), " from ",
                        scan.last + 1, " on missing");
  if (marked && chain_at != scene_marker->running_checksum)
    return absl::StrCat("record ", scene_marker->sequence, " is not the one that was written");
  const uint64_t gap_end = database.wal_watch().gap_end();
  if (gap_end > must.flushed_sequence && !must.closed && !database.wal_watch().has_records_after_gap(scene.key))
    return absl::StrCat("part of the log before the crash cannot be read, and records after ", scan.last,
                        " may have stood there");
  return "";
}

// Every byte, for whoever asks for it.
std::string deep_damage(const SceneHealth& scene, const Database& database, absl::Status& disk) {
  const SceneRow& row = *scene.row;
  const auto nowhere = [](absl::string_view) { return absl::OkStatus(); };
  absl::Status status =
      read_chunks(database, database.snapshot(), snapshot_prefix(row.key, row.snapshot_number), row.snapshot, nowhere);
  if (!status.ok()) return absl::StrCat("its snapshot: ", damage_of(status, disk));
  status = read_records(database, row.key, row.snapshot_sequence + 1, scene.last, row.running_checksum,
                        [](const LogRecord&) { return absl::OkStatus(); });
  return damage_of(status, disk);
}

absl::Status judge_scene(SceneHealth& scene, const SceneMarker* scene_marker, const DurableMarker* must,
                         const Standing& standing, const Database& database, Depth depth) {
  absl::Status disk;
  if (scene_marker != nullptr) scene.expected_sequence = scene_marker->sequence;
  scene.copied = scene_marker != nullptr && scene_marker->copied;
  scene.damage = scene_marker != nullptr ? scene_marker->damage : "";
  std::string more = must == nullptr ? std::string(kNoHighWater) : row_damage(scene, scene_marker, standing);
  // The numbers are wanted of a damaged scene, too.
  if (scene.row) {
    std::string log = log_damage(scene, scene_marker, must == nullptr ? DurableMarker() : *must, database, disk);
    if (more.empty()) more = std::move(log);
    if (more.empty() && depth == Depth::kEverything) more = deep_damage(scene, database, disk);
  }
  if (scene.damage.empty()) scene.damage = std::move(more);
  return disk;
}

absl::Status find_scenes(const DurableMarker* must, const Standing& standing, const Database& database, Depth depth,
                         DamageReport& found) {
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
  if (must != nullptr) {
    for (const SceneMarker& scene_marker : must->scene_markers) {
      scene_markers[scene_marker.scene] = &scene_marker;
      if (scenes.contains(scene_marker.scene)) continue;
      // Deleted after HIGH_WATER was written, and rightly so.
      if (standing.whole && standing.later && scene_marker.damage.empty()) continue;
      SceneHealth& scene = scenes[scene_marker.scene];
      scene.key = scene_marker.scene;
      scene.name = scene_marker.name;
    }
  }
  for (auto& [key, scene] : scenes) {
    const auto scene_marker = scene_markers.find(key);
    absl::Status disk = judge_scene(scene, scene_marker == scene_markers.end() ? nullptr : scene_marker->second, must,
                                    standing, database, depth);
    if (!disk.ok()) return disk;
    found.scenes.push_back(std::move(scene));
  }
  return absl::OkStatus();
}

absl::Status find_meshes(const Database& database, Depth depth, DamageReport& found) {
  absl::Status disk;
  const std::string start(1, kMeshTag);
  for (auto row = found.rows.lower_bound(start); row != found.rows.end() && row->first[0] == kMeshTag; ++row) {
    MeshHealth& mesh = found.meshes.emplace_back();
    mesh.name = row->first.substr(1);
    mesh.damage = found.catalogue_damage;
    if (const std::optional<MeshRow> name = decode_mesh(*verified(row->first, row->second))) {
      mesh.sha256 = name->sha256;
      mesh.parts = name->parts;
    }
    const auto content = found.rows.find(content_key(mesh.sha256));
    const std::optional<ContentRow> list =
        content == found.rows.end() ? std::nullopt : decode_content(*verified(content->first, content->second));
    if (list) mesh.content = *list;
    if (!list && mesh.damage.empty()) mesh.damage = "its content is lost";
    if (!mesh.damage.empty() || depth == Depth::kKeys) continue;
    const auto nowhere = [](absl::string_view) { return absl::OkStatus(); };
    absl::Status read = read_chunks(database, database.mesh(), mesh_prefix(mesh.sha256, mesh.content.number),
                                    mesh.content.chunks, nowhere);
    if (read.ok() && mesh.parts)
      read = read_chunks(database, database.mesh(), mesh_prefix(mesh.sha256, mesh.parts->number), mesh.parts->chunks,
                         nowhere);
    mesh.damage = damage_of(read, disk);
  }
  return disk;
}

}  // namespace

absl::StatusOr<DamageReport> verify(const Database& database, const DurableMarker* durable_marker, Depth depth) {
  DamageReport found;
  RETURN_IF_ERROR(read_meta(database, found));
  Standing standing;
  if (durable_marker != nullptr) standing = compare(found, *durable_marker);
  if (durable_marker == nullptr) {
    found.catalogue_damage = std::string(kNoHighWater);
  } else if (!durable_marker->catalogue_damage.empty()) {
    found.catalogue_damage = durable_marker->catalogue_damage;
  } else if (!standing.meshes) {
    found.catalogue_damage =
        "the catalogue of meshes is not the one that was written: names may be missing, or be back";
  } else if (standing.later && !standing.whole) {
    found.catalogue_damage =
        "the catalogue of scenes is not the one that was written: names may be missing, or be back";
  }
  absl::Status disk = find_scenes(durable_marker, standing, database, depth, found);
  if (disk.ok()) disk = find_meshes(database, depth, found);
  if (!disk.ok()) return disk;
  return found;
}

std::string repair_hint(const std::string& path) {
  return absl::StrCat("; `locusd check ", path, "` says more, `locusd repair ", path,
                      "` keeps what is sound, or restore a backup");
}

}  // namespace locus::server
