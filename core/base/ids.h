// Identifiers in a scene. Objects and instances share one id space per scene. The caller chooses the ids; 0 is never an
// id. An instance that is placed without an id gets one with bit 63 set.
#ifndef LOCUS_CORE_BASE_IDS_H_
#define LOCUS_CORE_BASE_IDS_H_

#include <cstdint>

namespace locus {

using Id = uint64_t;      // object or instance
using Group = uint64_t;   // such as a player or a vehicle; 0 = none
using Tag = uint64_t;     // any value of the user, returned on request
using Layers = uint32_t;  // bit mask, one bit per layer

inline constexpr Id kNoId = 0;
inline constexpr Id kChosenIdBit = Id{1} << 63;
inline constexpr uint32_t kNoTriangle = 0xFFFFFFFFu;
inline constexpr Layers kDefaultLayers = 1u;
inline constexpr Layers kAllLayers = 0xFFFFFFFFu;

}  // namespace locus

#endif  // LOCUS_CORE_BASE_IDS_H_
