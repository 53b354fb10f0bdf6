// All limits and their defaults. The command `locus limits` lists the limits, and a refusal names the limit that was
// exceeded. The assertions at the end verify relations between limits. The server configuration can lower some limits
// and replace some defaults.
#ifndef LOCUS_CORE_BASE_LIMITS_H_
#define LOCUS_CORE_BASE_LIMITS_H_

#include <cstddef>
#include <cstdint>

namespace locus::limits {

inline constexpr double kMaxCoordinate = 1e9;            // largest |value| of any coordinate, half extent or radius
inline constexpr double kMaxQuaternionDeviation = 1e-3;  // largest accepted | |q| - 1 | of a quaternion q
// Range of the scale of an instance, chosen so that coordinates of the world, transformed to mesh axes, fit floats.
inline constexpr float kMinScale = 1e-12f;
inline constexpr float kMaxScale = 1e12f;

inline constexpr uint32_t kMaxScenes = 1024;
inline constexpr uint32_t kMaxMeshes = 65536;
inline constexpr uint32_t kMaxNameLength = 63;  // names of scenes and of meshes
inline constexpr uint32_t kMaxLabels = 16;
inline constexpr uint32_t kMaxLabelLength = 256;
inline constexpr uint32_t kMaxLifetimeSeconds = 31'536'000;  // a year: of an idle scene, and of an unused mesh
inline constexpr uint32_t kMaxCreatorLength = 256;  // length in bytes of the name of a scene's or mesh's creator
inline constexpr uint32_t kMaxMeshParts = 65536;
inline constexpr uint32_t kMaxMeshVertices = 1u << 28;
inline constexpr uint32_t kMaxMeshTriangles = 1u << 27;
inline constexpr uint32_t kMaxInstances = 1u << 20;  // instances per scene
inline constexpr uint32_t kMaxObjects = 1u << 24;    // objects per scene
inline constexpr uint32_t kMaxParts = 64;            // parts of a compound
inline constexpr uint32_t kMaxPendingChanges = 64;   // queued static changes (of instances) per scene

inline constexpr uint32_t kMaxBvhValues = kMaxMeshTriangles;
inline constexpr uint32_t kMaxBvhDepth = 64;  // max levels of nodes; sets the size of the traversal stack
inline constexpr uint32_t kMaxBvhBins = 64;
inline constexpr uint32_t kMaxKdDepth = 64;      // max levels below the root of a kd tree; sets the sizes of stacks
inline constexpr uint32_t kMaxBspDepth = 64;     // max planes above a leaf of a bsp tree; sizes the stacks of visits
inline constexpr uint32_t kMaxOctreeDepth = 64;  // max levels below the root of an octree
inline constexpr uint32_t kMaxGridCells = 1u << 26;  // max cells of a finite grid, with its power-of-two strides

inline constexpr uint32_t kMaxUpdateItems = 1u << 20;  // items per update batch
inline constexpr uint32_t kMaxUpdateLists = 65536;     // lists (inserts, moves, relabels and so on) per request
inline constexpr uint32_t kMaxUpdateMessages = 4096;   // messages that together are one update batch
inline constexpr uint64_t kMaxExpireTicks = uint64_t{1} << 48;  // longest existence of an object that expires
inline constexpr uint32_t kMaxLeaseMs = 86'400'000;             // longest lease of a writer
inline constexpr uint32_t kMaxLeases = 4096;                    // leases of writers per scene
inline constexpr uint32_t kMaxListedItemErrors = 1000;          // max refused items listed in an ack
inline constexpr uint32_t kMaxWriters = 4096;  // writer ids stored per scene, to detect batches sent twice

inline constexpr uint32_t kMaxBlocks = 256;     // blocks per query batch
inline constexpr uint32_t kMaxQueries = 65536;  // queries other than rays per query batch, summed over all blocks
inline constexpr uint32_t kMaxRays = 262'144;   // rays per query batch, summed over all blocks
// Memory of the instances that a query batch interpolates between ticks at which they moved.
inline constexpr uint64_t kMaxInterpolatedBytes = uint64_t{256} << 20;
inline constexpr uint32_t kMaxIgnoredIds = 64;        // ids that the queries of a block ignore
inline constexpr uint32_t kMaxOnlyGroups = 16;        // groups to which a query is restricted
inline constexpr uint32_t kDefaultMaxResults = 1024;  // results per query if the block sets no max_results
inline constexpr uint32_t kMaxMaxResults = 1u << 20;  // largest max_results of a block
inline constexpr uint32_t kMaxNearest = 65536;        // max k of a nearest query, which returns up to k results
inline constexpr uint32_t kMinPlanes = 4;             // min planes of a convex region
inline constexpr uint32_t kDefaultPlanes = 6;
inline constexpr uint32_t kMaxPlanes = 32;
inline constexpr uint32_t kMaxRegionPlanes = 131'072;     // planes of all convex regions of a query batch
inline constexpr uint32_t kMaxSightSamples = 255;         // sample points of a target
inline constexpr uint32_t kMaxSightEyes = 16;             // eyes of a viewer
inline constexpr uint32_t kMaxSightSegments = 4'194'304;  // segments from an eye to a sample, per query batch
inline constexpr uint32_t kMaxPairNeighbours = 1024;      // max nearest objects of each object in a pairs query
inline constexpr uint32_t kMaxCellPlanes = 64;            // planes of a cell of free space
inline constexpr uint32_t kDefaultCellPlanes = 32;
// Default maximum size of a reply in bytes. gRPC clients refuse messages over 4 MiB by default.
inline constexpr uint32_t kDefaultReplyBytes = 4'000'000;
inline constexpr uint32_t kMaxReplyBytes = 64u << 20;

// Each scene retains recent revisions, so that a query can ask for one exact revision. These are the limits:
// kRecentRevisions is the maximum number of retained revisions. kRecentBytes is the maximum size in bytes of the data
// that updates have replaced since the oldest retained revision.
inline constexpr uint32_t kRecentRevisions = 64;
inline constexpr uint64_t kRecentBytes = 2u << 20;
// Readers that pin old revisions keep replaced data from being freed. The maximum size of this data per scene, in
// bytes, is kPinnedBytes or, if larger, kPinnedShare times the memory of the scene.
inline constexpr uint64_t kPinnedBytes = uint64_t{256} << 20;
inline constexpr uint32_t kPinnedShare = 4;
inline constexpr uint64_t kMinPinnedBytes = 1u << 20;         // smallest configurable value of kPinnedBytes
inline constexpr uint64_t kSnapshotAfterBytes = 64u << 20;    // bytes of log after which the scene is snapshotted
inline constexpr uint64_t kMinSnapshotAfterBytes = 1u << 16;  // smallest configurable value of kSnapshotAfterBytes
inline constexpr uint32_t kDefaultWaitMs = 1000;              // max wait for a revision in a call without a deadline
inline constexpr uint32_t kTestsBetweenChecks = 4096;         // primitive tests between two checks of the deadline

inline constexpr uint32_t kMaxHistoryTicks = 1u << 14;                 // ticks of history per scene
inline constexpr uint64_t kDefaultHistoryBytes = uint64_t{256} << 20;  // bytes of history per scene
inline constexpr uint64_t kMaxHistoryBytes = uint64_t{1} << 40;        // max bytes of history that a scene can request

inline constexpr uint32_t kReceiveBytes = 32u << 20;        // size in bytes of the largest received message
inline constexpr uint32_t kMaxStreams = 1024;               // open update and query streams of one client
inline constexpr uint32_t kMaxCalls = 256;                  // concurrent calls of one client, not counting streams
inline constexpr uint32_t kMaxThreads = 256;                // worker threads
inline constexpr uint32_t kMaxWaitingBatches = 1024;        // max entries in the queue of batches for helper threads
inline constexpr uint64_t kMinMemory = uint64_t{64} << 20;  // smallest configurable memory limit, in bytes
inline constexpr uint64_t kMaxMemory = uint64_t{1} << 50;   // largest configurable memory limit, in bytes
inline constexpr uint32_t kMaxDrainGraceS = 3600;           // max seconds that shutdown waits for active calls
inline constexpr uint32_t kMaxListenAddresses = 16;
inline constexpr uint32_t kMaxPageSize = 1000;  // scenes or meshes per page

inline constexpr uint32_t kMaxBackups = 1;  // concurrent backups
inline constexpr uint32_t kMaxBackupFiles = 1u << 20;
inline constexpr uint32_t kBackupPieceBytes = 1u << 20;  // bytes of a backup file per message

static_assert(kMaxBlocks <= kMaxQueries);
static_assert(uint64_t{kMaxRays} * 64 <= kReceiveBytes, "rays fit a message with origins, directions and filters");
static_assert(uint64_t{kMaxRays} * 8 + 1024 <= kDefaultReplyBytes, "the distances of all rays fit a default reply");
static_assert(kDefaultHistoryBytes <= kMaxHistoryBytes);
static_assert(kDefaultMaxResults <= kMaxMaxResults);
static_assert(kMaxNearest <= kMaxMaxResults);
static_assert(kMaxCellPlanes < kMaxMaxResults);
static_assert(kDefaultReplyBytes < 4u << 20, "clients refuse messages over 4 MiB by default");
static_assert(kDefaultReplyBytes <= kMaxReplyBytes);
static_assert(kBackupPieceBytes < kDefaultReplyBytes / 2, "a path and a hash fit into the same message");
static_assert(kMaxInstances <= kMaxBvhValues);
static_assert(uint64_t{kMaxMeshTriangles} * 3 < uint64_t{1} << 32, "index positions fit 32 bits");

}  // namespace locus::limits

#endif  // LOCUS_CORE_BASE_LIMITS_H_
