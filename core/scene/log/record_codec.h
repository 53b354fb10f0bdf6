// Encodes and decodes the records of a scene's log. A record is an update batch, several joined batches, or a static
// change. The result of applying a record depends only on the record and on the state before it, so that a replay
// produces the same revision, acks and refused items. FORMAT.md describes the bytes.
//
// Decoding validates everything and returns DATA_LOSS, with a description, if the bytes are damaged. Columns that a
// shape's kind does not use are not stored. Plain functions; any thread.
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

// Version of the effect of records: it changes whenever a record of the same bytes would change a scene in another way.
// Only daemons of equal versions may follow each other, or replay records of each other.
inline constexpr uint64_t kApplyVersion = 1;

// Append one record to `to`, whose size is a multiple of 8 before and after. Preconditions: the batches have passed
// check_form(), and the batches of encode_joined() satisfy may_join().
void encode_batch(const UpdateBatch& batch, std::string& to);
void encode_joined(absl::Span<const UpdateBatch* const> batches, std::string& to);
// Appends a static change. `placed` has the ids of all placed instances in the order of the change, including the ids
// that the scene chose.
void encode_change(const StaticChange& change, absl::Span<const Id> placed, std::string& to);

// Decoded record. The columns of content() point into the bytes passed to decode(), which must outlive the record, or
// into an aligned copy that the record holds.
class Record {
 public:
  static absl::StatusOr<Record> decode(absl::string_view bytes);

  struct Joined {
    std::vector<UpdateBatch> batches;  // at least one; all satisfy may_join()
  };
  struct Change {
    StaticChange change;          // all placements have ids; all mesh pointers are null
    std::vector<MeshKey> meshes;  // key of each placement's mesh; without a name in data format 1
    std::vector<Aabbf> bounds;    // bounds of each placement's mesh; no entries in data formats 1 to 3
  };
  using Content = std::variant<UpdateBatch, Joined, Change>;  // all batches have passed check_form()
  Content& content() { return content_; }
  const Content& content() const { return content_; }

 private:
  explicit Record(absl::string_view bytes) : bytes_(bytes) {}

  AlignedBytes bytes_;
  Content content_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_RECORD_CODEC_H_
