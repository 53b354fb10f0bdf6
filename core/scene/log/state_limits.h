// How much of a scene goes into one chunk of its state: shared by what writes chunks and what reads them. Part of
// the format: what is written may become less, what is read may not.
#ifndef LOCUS_CORE_SCENE_LOG_STATE_LIMITS_H_
#define LOCUS_CORE_SCENE_LOG_STATE_LIMITS_H_

#include <cstddef>

#include "core/base/limits.h"

namespace locus {

inline constexpr size_t kObjectsPerChunk = 8192;
inline constexpr size_t kMaxBytesOfObject = 8 + 8 + 8 + 4 + 1 + 24 + 16 + 12 + 4;
inline constexpr size_t kInstancesPerChunk = 4096;
// With a mesh of its own: the content's hash, and the name with its length and padding.
inline constexpr size_t kMaxBytesOfInstance = 32 + 8 + limits::kMaxNameLength + 1 + 8 + 8 + 8 + 4 + 4 + 24 + 16 + 4;
// The longest that update_batch.h names is inserts[65535].capsule.half_axes, and numbers of lists may have ten digits.
inline constexpr size_t kMaxErrorField = 128;
inline constexpr size_t kMaxBytesOfError = 24 + kMaxErrorField;

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_STATE_LIMITS_H_
