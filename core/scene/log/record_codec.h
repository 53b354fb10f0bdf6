// What a record of a scene's log says: a batch, several that were joined, or a static change, each as it was when the
// scene let it in. A record says everything that its application depends on beside the state before it, so that
// applying it again to that state gives the same revision, acks and refused items.
//
// Decoding trusts the bytes with nothing: DATA_LOSS says what is wrong. Plain functions; any thread. Columns that a
// shape's kind does not use are not kept.
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

// Each appends one record to `to`, whose size is and stays a multiple of 8. Batches have passed check_form(); those of
// the second may_join().
void encode_batch(const UpdateBatch& batch, std::string& to);
void encode_joined(absl::Span<const UpdateBatch* const> batches, std::string& to);
// `placed`: the ids that instances got, in order.
void encode_change(const StaticChange& change, absl::Span<const Id> placed, std::string& to);

// A record again. What it says borrows from it, and it borrows from the bytes.
class Record {
 public:
  static absl::StatusOr<Record> decode(absl::string_view bytes);

  struct Joined {
    std::vector<UpdateBatch> batches;  // at least one; all may_join()
  };
  struct Change {
    StaticChange change;          // without meshes, with ids
    std::vector<MeshKey> meshes;  // of each placement; without names in format 1
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
