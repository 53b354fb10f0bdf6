// Refusals of a log that has, or has not, a scene or mesh. Pure functions; any thread.
#ifndef LOCUS_SERVER_STORAGE_ROWS_REFUSALS_H_
#define LOCUS_SERVER_STORAGE_ROWS_REFUSALS_H_

#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "core/base/refusal.h"
#include "core/scene/log/update_log.h"

namespace locus::server {

// Returns ALREADY_EXISTS for `field`.
inline absl::Status already_stored(absl::string_view field, absl::string_view what) {
  Refusal refusal;
  refusal.reason = Reason::kAlreadyExists;
  refusal.field = std::string(field);
  return refuse(absl::StatusCode::kAlreadyExists, what, refusal);
}

// Returns NOT_FOUND.
inline absl::Status not_stored(absl::string_view what) {
  Refusal refusal;
  refusal.reason = Reason::kNotFound;
  return refuse(absl::StatusCode::kNotFound, what, refusal);
}
inline absl::Status scene_not_stored(SceneKey scene) {
  return not_stored(absl::StrCat("the log has no scene ", scene, "; it may have been deleted"));
}
inline absl::Status mesh_not_stored(absl::string_view name) {
  return not_stored(absl::StrCat("the log has no mesh '", name, "'"));
}

// Return ALREADY_EXISTS for a name that another scene has, or a mesh of other content.
inline absl::Status scene_already_stored(absl::string_view name) {
  return already_stored("name",
                        absl::StrCat("a scene '", name, "' is stored already: delete it or choose another name"));
}
inline absl::Status mesh_already_stored(absl::string_view name) {
  return already_stored(
      "name", absl::StrCat("a mesh '", name, "' of other content is stored already: delete it or choose another name"));
}

// Returns NOT_FOUND for a mesh that is not stored with the content that is wanted.
inline absl::Status mesh_content_not_stored(absl::string_view name) {
  return not_stored(absl::StrCat("the log has no mesh '", name, "' of this content: it was deleted, or replaced"));
}
// Returns FAILED_PRECONDITION for a mesh that cannot be deleted because scenes place `instances` instances of it.
inline absl::Status refuse_mesh_in_use(absl::string_view name, uint64_t instances) {
  Refusal refusal;
  refusal.reason = Reason::kInUse;
  refusal.field = "mesh";
  refusal.asked = static_cast<double>(instances);
  return refuse(absl::StatusCode::kFailedPrecondition,
                instances > 0 ? absl::StrCat("mesh ", name, " is used by ", instances, " instances; remove them first")
                              : absl::StrCat("mesh ", name, " is being placed; try again once that is done"),
                refusal);
}

// Returns FAILED_PRECONDITION for records of the epoch `asked` while the scene `name` is in the epoch `epoch`.
inline absl::Status refuse_epoch(absl::string_view name, uint64_t epoch, uint64_t asked) {
  Refusal refusal;
  refusal.reason = Reason::kSceneRestarted;
  return refuse(
      absl::StatusCode::kFailedPrecondition,
      absl::StrCat("scene '", name, "' is in epoch ", epoch, ", not ", asked, ": load it anew before writing to it"),
      refusal);
}

// Returns INVALID_ARGUMENT for a read from record `from` on, where the snapshot includes the records up to `snapshot`.
inline absl::Status refuse_read_before(uint64_t snapshot) {
  return refuse_argument(Reason::kOutOfRange, "from", std::nullopt,
                         absl::StrCat("the records up to ", snapshot, " are in the snapshot: read it instead"));
}

// Returns INVALID_ARGUMENT for a snapshot at a record that is not one from `first` to `last`.
inline absl::Status refuse_snapshot_at(uint64_t sequence, uint64_t first, uint64_t last) {
  return refuse_argument(
      Reason::kOutOfRange, "sequence", std::nullopt,
      absl::StrCat("the last record of a snapshot must be one from ", first, " to ", last, ", not ", sequence));
}

// Returns INVALID_ARGUMENT for a chunk of `bytes` bytes.
inline absl::Status refuse_chunk(size_t bytes) {
  return refuse_limit("state", "chunk_bytes", static_cast<double>(UpdateLog::kMaxChunkBytes),
                      static_cast<double>(bytes));
}

// Returns FAILED_PRECONDITION for the scene `name`, whose records another version of locusd has written.
inline absl::Status refuse_apply_version(absl::string_view name, uint64_t stored, uint64_t own) {
  return absl::FailedPreconditionError(absl::StrCat(
      "scene '", name, "' has records of version ", stored, ", and this locusd replays only those of version ", own,
      ": start a locusd of the version that wrote them and drain it, which leaves nothing to replay"));
}

// Returns ABORTED for the scene `name`, which another daemon leads.
inline absl::Status refuse_fenced(absl::string_view name) {
  return absl::AbortedError(absl::StrCat("scene '", name, "' has another leader: this daemon may no longer change it"));
}

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROWS_REFUSALS_H_
