// The names of things in a scene. Objects and instances share one id space per scene, chosen by the caller; 0 names
// nothing. An instance placed without an id gets one with bit 63 set.
#ifndef LOCUS_CORE_BASE_IDS_H_
#define LOCUS_CORE_BASE_IDS_H_

#include <cstdint>

namespace locus {

using Id = uint64_t;     // an object or an instance
using Group = uint64_t;  // a player, a vehicle; 0 = none
using Tag = uint64_t;    // the user's own, returned on request
using Layers = uint32_t;

inline constexpr Id kNoId = 0;
inline constexpr Id kChosenIdBit = Id{1} << 63;
inline constexpr uint32_t kNoTriangle = 0xFFFFFFFFu;
inline constexpr Layers kDefaultLayers = 1u;
inline constexpr Layers kAllLayers = 0xFFFFFFFFu;

}  // namespace locus

#endif  // LOCUS_CORE_BASE_IDS_H_
