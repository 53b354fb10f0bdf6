// All limits and their defaults. `locus limits` lists them, and a refusal names the limit that was exceeded. Relations
// between limits are asserted below. The server configuration can lower some of them; it cannot raise any.
#ifndef LOCUS_CORE_BASE_LIMITS_H_
#define LOCUS_CORE_BASE_LIMITS_H_

#include <cstddef>
#include <cstdint>

namespace locus::limits {

inline constexpr double kMaxCoordinate = 1e9;            // largest |x| of any position, frame or extent
inline constexpr double kMaxQuaternionDeviation = 1e-3;  // largest accepted | |q| - 1 |
// Range of the scale of an instance: chosen so that the world, transformed to mesh axes, fits floats.
inline constexpr float kMinScale = 1e-12f;
inline constexpr float kMaxScale = 1e12f;

inline constexpr uint32_t kMaxScenes = 1024;
inline constexpr uint32_t kMaxMeshes = 65536;
inline constexpr uint32_t kMaxNameLength = 63;  // names of scenes and of meshes
inline constexpr uint32_t kMaxLabels = 16;
inline constexpr uint32_t kMaxLabelLength = 256;
inline constexpr uint32_t kMaxMeshParts = 65536;
inline constexpr uint32_t kMaxMeshVertices = 1u << 28;
inline constexpr uint32_t kMaxMeshTriangles = 1u << 27;
inline constexpr uint32_t kMaxInstances = 1u << 20;  // per scene
inline constexpr uint32_t kMaxObjects = 1u << 24;    // per scene
inline constexpr uint32_t kMaxPendingChanges = 64;   // queued static changes per scene

inline constexpr uint32_t kMaxBvhValues = kMaxMeshTriangles;
inline constexpr uint32_t kMaxBvhDepth = 64;  // max levels of nodes for any input; sets the size of the traversal stack
inline constexpr uint32_t kMaxBvhBins = 64;

inline constexpr uint32_t kMaxUpdateItems = 1u << 20;   // per batch
inline constexpr uint32_t kMaxUpdateLists = 65536;      // insert, move and relabel lists per batch, empty ones included
inline constexpr uint32_t kMaxListedItemErrors = 1000;  // errors listed in an ack; all are counted
inline constexpr uint32_t kMaxWriters = 4096;           // writers remembered per scene, so that retries are safe

inline constexpr uint32_t kMaxBlocks = 256;                // per query batch
inline constexpr uint32_t kMaxQueries = 65536;             // per query batch, summed over all blocks
inline constexpr uint32_t kMaxIgnoredIds = 64;             // per block
inline constexpr uint32_t kDefaultMaxResults = 1024;       // per query
inline constexpr uint32_t kMaxMaxResults = 1u << 20;       // per query
inline constexpr uint32_t kMaxNearest = 65536;             // k of a nearest query
inline constexpr uint32_t kDefaultReplyBytes = 4'000'000;  // clients refuse 4 MiB by default
inline constexpr uint32_t kMaxReplyBytes = 64u << 20;

// Revisions that stay available to `exactly` views: at most so many, and only while the data that later revisions
// replaced takes at most so many bytes.
inline constexpr uint32_t kRecentRevisions = 64;
inline constexpr uint64_t kRecentBytes = 2u << 20;
// Bytes of replaced data that readers of old revisions may keep from being freed, per scene: kPinnedBytes or, if
// larger, kPinnedShare times the memory of the scene.
inline constexpr uint64_t kPinnedBytes = uint64_t{256} << 20;
inline constexpr uint32_t kPinnedShare = 4;
inline constexpr uint64_t kMinPinnedBytes = 1u << 20;         // smallest configurable value
inline constexpr uint64_t kSnapshotAfterBytes = 64u << 20;    // bytes of a scene's log after which it is snapshotted
inline constexpr uint64_t kMinSnapshotAfterBytes = 1u << 16;  // smallest configurable value
inline constexpr uint32_t kDefaultWaitMs = 1000;              // wait of an `at_least` view without a deadline
inline constexpr uint32_t kTestsBetweenChecks = 4096;         // primitive tests between two checks of the deadline

inline constexpr uint32_t kMaxHistoryTicks = 1u << 14;                 // per scene
inline constexpr uint64_t kDefaultHistoryBytes = uint64_t{256} << 20;  // per scene with history
inline constexpr uint64_t kMaxHistoryBytes = uint64_t{1} << 40;        // largest configurable value

inline constexpr uint32_t kReceiveBytes = 32u << 20;  // largest received message
inline constexpr uint32_t kMaxStreams = 1024;         // open update and query streams
inline constexpr uint32_t kMaxCalls = 256;            // concurrent calls, without streams
inline constexpr uint32_t kMaxThreads = 256;          // worker threads
inline constexpr uint32_t kMaxWaitingBatches = 1024;  // batches waiting for helper threads; others run on one thread
inline constexpr uint64_t kMinMemory = uint64_t{64} << 20;  // smallest configurable memory limit, in bytes
inline constexpr uint64_t kMaxMemory = uint64_t{1} << 50;   // largest configurable memory limit, in bytes
inline constexpr uint32_t kMaxDrainGraceS = 3600;           // max seconds for active calls to finish at shutdown
inline constexpr uint32_t kMaxListenAddresses = 16;
inline constexpr uint32_t kMaxPageSize = 1000;  // scenes or meshes per page

inline constexpr uint32_t kMaxBackups = 1;  // concurrent backups
inline constexpr uint32_t kMaxBackupFiles = 1u << 20;
inline constexpr uint32_t kBackupPieceBytes = 1u << 20;  // bytes of a file per message

static_assert(kMaxBlocks <= kMaxQueries);
static_assert(kDefaultHistoryBytes <= kMaxHistoryBytes);
static_assert(kDefaultMaxResults <= kMaxMaxResults);
static_assert(kMaxNearest <= kMaxMaxResults);
static_assert(kDefaultReplyBytes < 4u << 20, "clients refuse messages over 4 MiB by default");
static_assert(kDefaultReplyBytes <= kMaxReplyBytes);
static_assert(kBackupPieceBytes < kDefaultReplyBytes / 2, "a path and a hash fit beside it");
static_assert(kMaxInstances <= kMaxBvhValues);
static_assert(uint64_t{kMaxMeshTriangles} * 3 < uint64_t{1} << 32, "index positions fit 32 bits");

}  // namespace locus::limits

#endif  // LOCUS_CORE_BASE_LIMITS_H_
