// Limits of one chunk of a scene's state, shared by StateWriter and StateReader. Part of the format: a later version
// may write less into a chunk, but must read as much.
#ifndef LOCUS_CORE_SCENE_LOG_STATE_LIMITS_H_
#define LOCUS_CORE_SCENE_LOG_STATE_LIMITS_H_

#include <cstddef>

#include "core/base/limits.h"

namespace locus {

inline constexpr size_t kObjectsPerChunk = 8192;
inline constexpr size_t kMaxBytesOfObject = 8 + 8 + 8 + 4 + 1 + 24 + 16 + 12 + 4;
inline constexpr size_t kInstancesPerChunk = 4096;
// An instance with a mesh that no other one uses: the content's hash, and the name with its length and padding.
inline constexpr size_t kMaxBytesOfInstance = 32 + 8 + limits::kMaxNameLength + 1 + 8 + 8 + 8 + 4 + 4 + 24 + 16 + 4;
// Longest field of an ItemError: inserts[65535].capsule.half_axes, with room for list indices of ten digits.
inline constexpr size_t kMaxErrorField = 128;
inline constexpr size_t kMaxBytesOfError = 24 + kMaxErrorField;

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_STATE_LIMITS_H_
