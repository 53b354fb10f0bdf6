// Encodes and decodes the records of a scene's log: an update batch, several joined batches, or a static change, as the
// scene admitted it. Applying a record depends only on the record and on the state before it, so that a replay gives
// the same revision, acks and refused items. FORMAT.md describes the bytes.
//
// Decoding validates everything: DATA_LOSS describes damage. Plain functions; any thread. Columns that the kind of a
// shape does not use are not stored.
#ifndef LOCUS_CORE_SCENE_LOG_RECORD_CODEC_H_
#define LOCUS_CORE_SCENE_LOG_RECORD_CODEC_H_

#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "core/scene/log/byte_codec.h"
#include "core/scene/statics/static_set.h"
#include "core/scene/updates/update_batch.h"

namespace locus {

// Append one record to `to`. Preconditions: the size of `to` is a multiple of 8, and stays so; batches have passed
// check_form(); the batches of encode_joined() may_join().
void encode_batch(const UpdateBatch& batch, std::string& to);
void encode_joined(absl::Span<const UpdateBatch* const> batches, std::string& to);
// `placed`: ids of the placed instances, chosen ids included, in the order of the change.
void encode_change(const StaticChange& change, absl::Span<const Id> placed, std::string& to);

// Decoded record. Its content borrows from the record, and the record borrows from the bytes.
class Record {
 public:
  static absl::StatusOr<Record> decode(absl::string_view bytes);

  struct Joined {
    std::vector<UpdateBatch> batches;  // at least one; all may_join()
  };
  struct Change {
    StaticChange change;          // with ids, without mesh pointers
    std::vector<MeshKey> meshes;  // mesh of each placement; without names in format 1
  };
  using Content = std::variant<UpdateBatch, Joined, Change>;  // batches pass check_form()
  Content& content() { return content_; }
  const Content& content() const { return content_; }

 private:
  explicit Record(absl::string_view bytes) : bytes_(bytes) {}

  AlignedBytes bytes_;
  Content content_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_RECORD_CODEC_H_
