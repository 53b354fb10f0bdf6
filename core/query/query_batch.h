// Batch of queries as borrowed columns: a list of blocks, each of one kind. The service points the columns at the data
// of a request without copying, and run/ answers the batch. Plain data; any number of threads may read it.
//
// The caller keeps the columns alive while the batch is in use. Let N be query_count(), the number of queries of a
// block. Unless stated otherwise, a column has N entries, one entry for all queries, or no entries; the default
// applies to a column without entries. An entry is one number, a vector of 3 numbers or a quaternion of 4 numbers.
#ifndef LOCUS_CORE_QUERY_QUERY_BATCH_H_
#define LOCUS_CORE_QUERY_QUERY_BATCH_H_

#include <initializer_list>
#include <type_traits>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/types/span.h"
#include "core/base/block_kind.h"
#include "core/base/ids.h"
#include "core/base/limits.h"
#include "core/geometry/mover.h"
#include "core/geometry/ray.h"

namespace locus {

enum class Source : uint8_t { kBoth, kStatic, kDynamic };
enum class Precision : uint8_t { kExact, kConservative };
enum class OutsideHistory : uint8_t { kReject, kClamp };
enum class RayMode : uint8_t { kFirst, kAny, kAll };
enum class StaticDetail : uint8_t { kInstances, kTriangles, kTrianglesSorted };
enum class ClipDepth : uint8_t { kZeroToOne, kMinusOneToOne };

// Result columns that a block may request. The values equal those of the protocol's enum Column.
enum class Column : uint8_t {
  kT = 1,
  kId = 2,
  kTriangle = 3,
  kUv = 4,
  kNormal = 5,
  kPoint = 6,
  kGroup = 7,
  kTag = 8,
  kLayers = 9,
  kPose = 10,
  kOther = 11,
  kShape = 12,
};
inline constexpr Column kLastColumn = Column::kShape;

// Set of result columns, one bit each.
class ColumnSet {
 public:
  constexpr ColumnSet() = default;
  constexpr ColumnSet(std::initializer_list<Column> columns) {
    for (const Column column : columns) add(column);
  }
  constexpr void add(Column column) { bits_ |= 1u << static_cast<unsigned>(column); }
  constexpr bool has(Column column) const { return (bits_ >> static_cast<unsigned>(column) & 1u) != 0; }
  constexpr bool empty() const { return bits_ == 0; }

 private:
  uint32_t bits_ = 0;
};

// Position of each query in the order of rows (t, id, triangle): a query returns only rows after its position. Each
// column has one entry per query, one entry for all queries, or no entry. If `ts` has no entry, all rows are returned.
// If `ids` has no entry, a row whose t equals the given t is not returned. If `triangles` has no entry, a row whose t
// and id equal the given t and id is not returned either.
struct AfterColumns {
  absl::Span<const float> ts;            // not NaN
  absl::Span<const uint64_t> ids;        // only with ts
  absl::Span<const uint32_t> triangles;  // only with ids
};

struct RayColumns {
  absl::Span<const float> origins;     // N entries x y z, or one for all rays; relative to the frame
  absl::Span<const float> directions;  // N entries x y z, or one for all rays; the zero vector is refused
  absl::Span<const float> t_max;       // maximum t of a hit, >= 0; default: +inf
  RayMode mode = RayMode::kFirst;
  Cull cull = Cull::kNone;
  Inside inside = Inside::kSolid;
  AfterColumns after = {};
};

struct BallColumns {
  absl::Span<const float> centers;  // N entries x y z, relative to the frame
  absl::Span<const float> radii;    // N entries, or one for all balls; >= 0
  StaticDetail detail = StaticDetail::kInstances;
};

struct BoxColumns {
  absl::Span<const float> centers;       // N entries x y z, relative to the frame
  absl::Span<const float> half_extents;  // N entries x y z, or one for all boxes; >= 0
  absl::Span<const float> rotations;     // quaternions x y z w; default: no rotation
  StaticDetail detail = StaticDetail::kInstances;
};

struct CapsuleColumns {
  absl::Span<const float> starts;  // N entries x y z, relative to the frame: one end of the inner segment
  absl::Span<const float> ends;    // N entries x y z, or one for all capsules, relative to the frame: the other end
  absl::Span<const float> radii;   // N entries, or one for all capsules; >= 0
  StaticDetail detail = StaticDetail::kInstances;
};

// Solids that move from `starts` to `ends`: balls (radii), capsules (radii and half axes) or boxes (half extents).
struct SweepColumns {
  absl::Span<const float> starts;        // N entries x y z, relative to the frame: centres at t = 0
  absl::Span<const float> ends;          // N entries x y z, or one for all sweeps: centres at t = 1
  absl::Span<const float> radii;         // balls and capsules: N entries, or one for all; > 0
  absl::Span<const float> half_axes;     // capsules: N entries x y z, or one for all; centre to an end of the axis
  absl::Span<const float> half_extents;  // boxes: N entries x y z, or one for all; >= 0, not all 0
  absl::Span<const float> rotations;     // boxes: quaternions x y z w; default: no rotation
  RayMode mode = RayMode::kFirst;
  AtStart at_start = AtStart::kHit;
};

struct NearestColumns {
  absl::Span<const float> points;         // N entries x y z, relative to the frame
  absl::Span<const float> max_distances;  // maximum distance of a row, >= 0; default: +inf
  uint32_t count = 0;                     // maximum number of rows per query; 0 means 1
  StaticDetail detail = StaticDetail::kInstances;
  AfterColumns after = {};
};

// Convex regions, given by planes or by view-projection matrices: exactly one of the two columns has entries.
struct FrustumColumns {
  absl::Span<const float> planes;            // planes_each planes nx ny nz d for each region, relative to the frame
  absl::Span<const float> view_projections;  // 16 numbers for each region, column-major
  uint32_t planes_each = 0;                  // 4 .. 32; 0 means 6
  ClipDepth clip_depth = ClipDepth::kZeroToOne;
  StaticDetail detail = StaticDetail::kInstances;

  size_t planes_per_region() const { return planes_each == 0 ? 6 : planes_each; }
};

struct ContainsColumns {
  absl::Span<const float> points;  // N entries x y z, relative to the frame
};

// Viewers and targets; each viewer is a query.
struct SightColumns {
  absl::Span<const float> viewers;           // `eyes` points x y z for each viewer, relative to the frame
  absl::Span<const uint64_t> viewer_groups;  // default: 0, no group
  absl::Span<const float> targets;           // `samples` points x y z for each target, relative to the frame
  absl::Span<const uint64_t> target_groups;  // an entry for each target, one for all targets, or none; default: 0
  absl::Span<const float> max_distances;     // >= 0; default: +inf
  uint32_t samples = 0;                      // sample points of each target, 1 .. 255; 0 means 1
  uint32_t eyes = 0;                         // eyes of each viewer, 1 .. 16; 0 means 1
  bool pairwise = false;                     // viewer i looks only at target i

  size_t samples_per_target() const { return samples == 0 ? 1 : samples; }
  size_t eyes_per_viewer() const { return eyes == 0 ? 1 : eyes; }
  size_t viewer_count() const { return viewers.size() / (3 * eyes_per_viewer()); }
  size_t target_count() const { return targets.size() / (3 * samples_per_target()); }
  // Returns the number of result bytes of each viewer.
  size_t bytes_per_viewer() const { return pairwise ? 1 : target_count(); }
};

// Pairs of objects within a distance of each other. A block of this kind has one query.
struct PairColumns {
  float max_distance = 0;    // inclusive, 0 .. limits::kMaxCoordinate; +inf is allowed if count is not 0
  Layers first_mask = 0;     // 0 means all layers
  Layers second_mask = 0;    // 0 means all layers
  uint32_t count = 0;        // maximum number of nearest objects of each object; 0: all pairs, one row each
  uint64_t after_other = 0;  // requires QueryBlock::after_id: only rows after (after_id, after_other)
};

// Convex free space around points.
struct CellColumns {
  absl::Span<const float> points;         // N entries x y z, relative to the frame
  absl::Span<const float> max_distances;  // N entries, or one for all points; > 0, at most limits::kMaxCoordinate
  uint32_t max_planes = 0;                // 1 .. limits::kMaxCellPlanes; 0 means limits::kDefaultCellPlanes
};

// Lookup by id or by group. Each id has one result row. Each group has a row count, and one result row for each of its
// members. Exactly one of the two columns has entries.
struct LookupColumns {
  absl::Span<const uint64_t> ids;
  absl::Span<const uint64_t> groups;
};

struct QueryBlock {
  Vec3d frame;
  Source source = Source::kBoth;
  Precision precision = Precision::kExact;
  ColumnSet columns;                         // requested result columns; if empty, the default columns of the kind
  absl::Span<const uint32_t> masks;          // layer mask of each query; default: all layers
  absl::Span<const uint64_t> ignore_groups;  // group that each query ignores; default: 0, no group
  absl::Span<const uint64_t> ignore_ids;     // at most limits::kMaxIgnoredIds ids that every query of the block ignores
  // Entries of only_groups_per_query() groups, of which 0 is no group. A query whose entry has a group finds only
  // members of the groups in the entry.
  absl::Span<const uint64_t> only_groups;
  uint32_t only_groups_each = 0;  // at most limits::kMaxOnlyGroups; 0 means 1
  // A query finds only what has (tag & mask) == (entry of tags & mask), where mask is the entry of tag_masks; default:
  // all 64 bits.
  absl::Span<const uint64_t> tags;
  absl::Span<const uint64_t> tag_masks;     // only with tags
  absl::Span<const uint64_t> self_ids;      // id that each query ignores; default: 0, no id
  uint32_t max_results = 0;                 // maximum number of rows per query; 0: limits::kDefaultMaxResults
  Id after_id = kNoId;                      // overlaps, contains, pairs and groups return only higher ids
  absl::Span<const uint64_t> as_of_ticks;   // tick of each query; default: the snapshot's latest state
  absl::Span<const float> as_of_fractions;  // fraction of the way to the next tick, >= 0 and < 1; default: 0
  OutsideHistory outside = OutsideHistory::kReject;
  // N ids of objects or instances, or one for all queries: the anchor of each query. The positions of a query are
  // relative to the position of its anchor, and the query does not find its anchor.
  absl::Span<const uint64_t> anchor_ids;
  bool count_only = false;  // only the number of rows of each query is returned
  // Rays only: a unit quaternion x y z w that rotates the directions of all rays; default: no rotation. Rotated
  // directions are vectors of doubles and are not rounded to floats.
  absl::Span<const float> rotation;
  using Kind = std::variant<RayColumns, BallColumns, BoxColumns, LookupColumns, NearestColumns, CapsuleColumns,
                            SweepColumns, FrustumColumns, SightColumns, ContainsColumns, PairColumns, CellColumns>;
  Kind kind;

  size_t only_groups_per_query() const { return only_groups_each == 0 ? 1 : only_groups_each; }
};

// Returns the kind of the block. The value of a BlockKind is the index of its alternative in QueryBlock::kind, as
// asserted below.
constexpr BlockKind block_kind(const QueryBlock& block) { return static_cast<BlockKind>(block.kind.index()); }
template <BlockKind kKind>
using ColumnsOf = std::variant_alternative_t<static_cast<size_t>(kKind), decltype(QueryBlock::kind)>;
static_assert(std::is_same_v<ColumnsOf<BlockKind::kRay>, RayColumns>);
static_assert(std::is_same_v<ColumnsOf<BlockKind::kBall>, BallColumns>);
static_assert(std::is_same_v<ColumnsOf<BlockKind::kBox>, BoxColumns>);
static_assert(std::is_same_v<ColumnsOf<BlockKind::kLookup>, LookupColumns>);
static_assert(std::is_same_v<ColumnsOf<BlockKind::kNearest>, NearestColumns>);
static_assert(std::is_same_v<ColumnsOf<BlockKind::kCapsule>, CapsuleColumns>);
static_assert(std::is_same_v<ColumnsOf<BlockKind::kSweep>, SweepColumns>);
static_assert(std::is_same_v<ColumnsOf<BlockKind::kFrustum>, FrustumColumns>);
static_assert(std::is_same_v<ColumnsOf<BlockKind::kSight>, SightColumns>);
static_assert(std::is_same_v<ColumnsOf<BlockKind::kContains>, ContainsColumns>);
static_assert(std::is_same_v<ColumnsOf<BlockKind::kPairs>, PairColumns>);
static_assert(std::is_same_v<ColumnsOf<BlockKind::kCell>, CellColumns>);
static_assert(std::variant_size_v<decltype(QueryBlock::kind)> == kBlockKinds);

struct QueryBatch {
  std::vector<QueryBlock> blocks;
  uint64_t max_work = 0;         // maximum number of nodes, cells and primitive tests of the batch; 0: no limit
  uint32_t max_reply_bytes = 0;  // maximum encoded size of the reply in bytes; 0: limits::kDefaultReplyBytes
};

// Returns the number of queries of a block.
size_t query_count(const QueryBlock& block);

// Checks untrusted columns completely: lengths, limits and every value. Returns INVALID_ARGUMENT for the first invalid
// value or exceeded limit. The error names the field, such as blocks[2].rays.directions, and the index of the query.
absl::Status check_batch(const QueryBatch& batch);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_QUERY_BATCH_H_
