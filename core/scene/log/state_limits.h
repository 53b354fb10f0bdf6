// Limits of one chunk of a scene's state, shared by StateWriter and StateReader. They are part of the format: a later
// version may write smaller chunks, but must still read chunks of these sizes.
#ifndef LOCUS_CORE_SCENE_LOG_STATE_LIMITS_H_
#define LOCUS_CORE_SCENE_LOG_STATE_LIMITS_H_

#include <cstddef>

#include "core/base/limits.h"

namespace locus {

inline constexpr size_t kObjectsPerChunk = 8192;
// Maximum encoded size in bytes: id, group, tag, layers, kind, position, rotation, size and radius.
inline constexpr size_t kMaxBytesOfObject = 8 + 8 + 8 + 4 + 1 + 24 + 16 + 12 + 4;
inline constexpr size_t kInstancesPerChunk = 4096;
// Maximum encoded size in bytes. Includes the content hash and the name, with length and padding, of the instance's
// mesh, as if no other instance in the chunk used that mesh.
inline constexpr size_t kMaxBytesOfInstance = 32 + 8 + limits::kMaxNameLength + 1 + 8 + 8 + 8 + 4 + 4 + 24 + 16 + 4;
// Maximum length in bytes of ItemError::field. The longest field that is written, inserts[65535].capsule.half_axes, has
// 32; the rest is a reserve.
inline constexpr size_t kMaxErrorField = 128;
inline constexpr size_t kMaxBytesOfError = 24 + kMaxErrorField;

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_STATE_LIMITS_H_
