#include "core/scene/record_applier.h"

#include <utility>
#include <variant>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace locus {
namespace {

absl::StatusOr<SnapshotPtr> apply_change(SceneWriter& writer, Record::Change& change, const MeshOfRecord& find_mesh) {
  for (size_t i = 0; i < change.meshes.size(); ++i)
    change.change.place[i].mesh = find_mesh(change.meshes[i], change.bounds.empty() ? nullptr : &change.bounds[i]);
  const auto is_object = [&writer](Id id) { return writer.is_object(id); };
  absl::StatusOr<StaticSet::Changed> changed =
      writer.statics()->apply(change.change, is_object, ids_from(kFirstChosenId));
  if (!changed.ok()) return data_loss(absl::StrCat("the change is wrong: ", changed.status().message()));
  return writer.replace_statics(std::move(changed->set));
}

}  // namespace

absl::StatusOr<SnapshotPtr> apply_record(SceneWriter& writer, Record::Content& content, const MeshOfRecord& find_mesh) {
  if (const auto* batch = std::get_if<UpdateBatch>(&content); batch != nullptr) {
    absl::StatusOr<SceneWriter::Applied> applied = writer.apply(*batch);
    return applied.ok() ? std::move(applied->snapshot) : nullptr;
  }
  if (const auto* joined = std::get_if<Record::Joined>(&content); joined != nullptr) {
    std::vector<const UpdateBatch*> batches;
    for (const UpdateBatch& batch : joined->batches) batches.push_back(&batch);
    ASSIGN_OR_RETURN(SceneWriter::Joined applied, writer.apply_joined(batches, [] { return absl::OkStatus(); }));
    return std::move(applied.snapshot);
  }
  return apply_change(writer, std::get<Record::Change>(content), find_mesh);
}

}  // namespace locus
