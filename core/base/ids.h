// Identifiers in a scene. Objects and instances share one id space per scene. The caller chooses the ids; 0 is never an
// id. If the caller places an instance without an id, the scene chooses an id from kFirstChosenId on.
#ifndef LOCUS_CORE_BASE_IDS_H_
#define LOCUS_CORE_BASE_IDS_H_

#include <cstdint>

namespace locus {

using Id = uint64_t;      // id of an object or instance; 0 = no id
using Group = uint64_t;   // number that several objects share, such as a player; 0 = no group
using Tag = uint64_t;     // any value that the caller stores with an object; returned on request
using Layers = uint32_t;  // one bit per layer: the layers of an object, or the layers that a query searches

inline constexpr Id kNoId = 0;
inline constexpr Id kFirstChosenId = Id{1} << 32;
// Ids from here on are not counted on from, so that a caller's large id does not make all chosen ids large.
inline constexpr Id kEndOfChosenIds = Id{1} << 53;
inline constexpr uint32_t kNoTriangle = 0xFFFFFFFFu;
inline constexpr Layers kDefaultLayers = 1u;
inline constexpr Layers kAllLayers = 0xFFFFFFFFu;

}  // namespace locus

#endif  // LOCUS_CORE_BASE_IDS_H_
