// Every maximum in one place. A refusal names the limit by the name given here and `locus limits` lists them. Relations
// between maxima are asserted below; server configuration may lower some, never raise one above these.
#ifndef LOCUS_CORE_BASE_LIMITS_H_
#define LOCUS_CORE_BASE_LIMITS_H_

#include <cstddef>
#include <cstdint>

namespace locus::limits {

inline constexpr double kMaxCoordinate = 1e9;            // |x| of any position or frame, and of any extent
inline constexpr double kMaxQuaternionDeviation = 1e-3;  // of |q| from 1
inline constexpr float kMinScale = 1e-12f;               // of an instance: mesh axes must hold the world as floats
inline constexpr float kMaxScale = 1e12f;

inline constexpr uint32_t kMaxScenes = 1024;
inline constexpr uint32_t kMaxMeshes = 65536;
inline constexpr uint32_t kMaxNameLength = 63;  // scenes; also the characters of a mesh name
inline constexpr uint32_t kMaxLabels = 16;
inline constexpr uint32_t kMaxLabelLength = 256;
inline constexpr uint32_t kMaxMeshParts = 65536;
inline constexpr uint32_t kMaxMeshVertices = 1u << 28;
inline constexpr uint32_t kMaxMeshTriangles = 1u << 27;
inline constexpr uint32_t kMaxInstances = 1u << 20;  // per scene
inline constexpr uint32_t kMaxObjects = 1u << 24;    // per scene
inline constexpr uint32_t kMaxPendingChanges = 64;   // static changes waiting per scene

inline constexpr uint32_t kMaxBvhValues = kMaxMeshTriangles;
inline constexpr uint32_t kMaxBvhDepth = 64;  // levels of nodes, on any input: sizes the stack of a visit
inline constexpr uint32_t kMaxBvhBins = 64;

inline constexpr uint32_t kMaxUpdateItems = 1u << 20;   // per batch
inline constexpr uint32_t kMaxUpdateLists = 65536;      // per batch: inserts, moves and relabels, empty ones too
inline constexpr uint32_t kMaxListedItemErrors = 1000;  // all are counted
inline constexpr uint32_t kMaxWriters = 4096;           // remembered per scene, for retry safety

inline constexpr uint32_t kMaxBlocks = 256;                // per query batch
inline constexpr uint32_t kMaxQueries = 65536;             // per query batch, all blocks together
inline constexpr uint32_t kMaxIgnoredIds = 64;             // per block
inline constexpr uint32_t kDefaultMaxResults = 1024;       // per query
inline constexpr uint32_t kMaxMaxResults = 1u << 20;       // per query
inline constexpr uint32_t kMaxNearest = 65536;             // k of a query for what is nearest
inline constexpr uint32_t kDefaultReplyBytes = 4'000'000;  // clients refuse 4 MiB by default
inline constexpr uint32_t kMaxReplyBytes = 64u << 20;

inline constexpr uint32_t kRecentRevisions = 64;               // kept for `exactly` views ...
inline constexpr uint64_t kRecentBytes = 2u << 20;             // ... while what they replaced takes at most this much
inline constexpr uint64_t kPinnedBytes = uint64_t{256} << 20;  // that batches may keep from being freed, per scene ...
inline constexpr uint32_t kPinnedShare = 4;                    // ... or so often what the scene itself takes
inline constexpr uint64_t kMinPinnedBytes = 1u << 20;          // where that is set
inline constexpr uint64_t kSnapshotAfterBytes = 64u << 20;     // of a scene's log
inline constexpr uint64_t kMinSnapshotAfterBytes = 1u << 16;   // where that is set
inline constexpr uint32_t kDefaultWaitMs = 1000;               // at_least without a deadline
inline constexpr uint32_t kTestsBetweenChecks = 4096;          // primitive tests between two looks at the deadline

inline constexpr uint32_t kMaxHistoryTicks = 1u << 14;                 // per scene
inline constexpr uint64_t kDefaultHistoryBytes = uint64_t{256} << 20;  // per scene that keeps any ...
inline constexpr uint64_t kMaxHistoryBytes = uint64_t{1} << 40;        // ... and the most it may be given

inline constexpr uint32_t kReceiveBytes = 32u << 20;        // one message
inline constexpr uint32_t kMaxStreams = 1024;               // open update and query streams
inline constexpr uint32_t kMaxCalls = 256;                  // calls in work at once, streams apart
inline constexpr uint32_t kMaxThreads = 256;                // that work on one batch
inline constexpr uint32_t kMaxWaitingBatches = 1024;        // that wait for a helping thread; more work alone
inline constexpr uint64_t kMinMemory = uint64_t{64} << 20;  // bytes that a server may be told to get along with ...
inline constexpr uint64_t kMaxMemory = uint64_t{1} << 50;   // ... and the most it may be promised
inline constexpr uint32_t kMaxDrainGraceS = 3600;           // for calls in work when the server is told to end
inline constexpr uint32_t kMaxListenAddresses = 16;
inline constexpr uint32_t kMaxPageSize = 1000;  // scenes or meshes a page

inline constexpr uint32_t kMaxBackups = 1;  // under way at once
inline constexpr uint32_t kMaxBackupFiles = 1u << 20;
inline constexpr uint32_t kBackupPieceBytes = 1u << 20;  // of a file, in one message

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
