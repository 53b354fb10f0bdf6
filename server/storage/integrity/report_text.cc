#include "server/storage/integrity/report_text.h"

#include "absl/strings/str_cat.h"

namespace locus::server {
namespace {

std::string verdict(const std::string& damage) { return damage.empty() ? "sound" : absl::StrCat("DAMAGED: ", damage); }

std::string outcome_of(const SceneRepair& scene) {
  if (scene.deleted) return "had been deleted and is deleted again: nothing is lost";
  if (scene.dropped) return "LOST: no part of it could be kept";
  const std::string kept = absl::StrCat("kept up to record ", scene.kept_to, ", with a new epoch");
  if (scene.lost_from == 0) return absl::StrCat(kept, "; no lost record is known");
  return absl::StrCat(kept, "; LOST: records ", scene.lost_from, " to ", scene.lost_to);
}

}  // namespace

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
                  report.intact() ? "all is sound" : "NOT all is sound: run `locusd repair`, or restore a backup",
                  "\n");
  return text;
}

std::string to_text(const RepairReport& report) {
  if (!report.changed) return "all is sound: no file was changed\n";
  std::string text;
  for (const SceneRepair& scene : report.scenes)
    absl::StrAppend(&text, "scene ", scene.name, ": ", scene.damage, "; ", outcome_of(scene), "\n");
  for (const MeshRepair& mesh : report.meshes)
    absl::StrAppend(&text, "mesh ", mesh.name, ": ", mesh.damage, "; ", mesh.dropped ? "LOST" : "kept", "\n");
  absl::StrAppend(&text, "the old database is in ", report.kept_at, "; remove it when it is no longer needed\n");
  return text;
}

}  // namespace locus::server
