// Encodes and decodes the specification of a scene for its log. Plain functions; any thread.
#ifndef LOCUS_CORE_SCENE_SPEC_CODEC_H_
#define LOCUS_CORE_SCENE_SPEC_CODEC_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/scene/scene.h"

namespace locus {

// Returns the encoded specification.
std::string encode_spec(const SceneSpec& spec);
// Returns the specification that encode_spec() encoded, or DATA_LOSS, with a description, if `bytes` are damaged.
absl::StatusOr<SceneSpec> decode_spec(absl::string_view bytes);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SPEC_CODEC_H_
