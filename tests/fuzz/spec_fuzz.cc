// Stored specification of a scene: an accepted specification is within the limits, and its encoding is decoded and
// encoded again to equal bytes.
#include "core/base/limits.h"
#include "core/scene/spec_codec.h"
#include "tests/fuzz/fuzz_target.h"

namespace locus::fuzz {
namespace {

LOCUS_FUZZ_TARGET(spec) {
  const absl::StatusOr<SceneSpec> spec = decode_spec(input);
  if (!spec.ok()) return check_error(spec.status());
  LOCUS_CHECK_LE(spec->history.ticks, limits::kMaxHistoryTicks);
  LOCUS_CHECK_LE(spec->labels.size(), limits::kMaxLabels);
  const std::string bytes = encode_spec(*spec);
  const absl::StatusOr<SceneSpec> again = decode_spec(bytes);
  LOCUS_CHECK(again.ok());
  LOCUS_CHECK(encode_spec(*again) == bytes);
}

}  // namespace
}  // namespace locus::fuzz
