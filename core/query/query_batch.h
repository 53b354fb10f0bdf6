// Batch of queries as borrowed columns: a list of blocks, each of one kind. For the service, which fills it from a
// request without copying, and for run/, which answers it. Plain data; any number of threads may read it.
//
// The caller keeps the columns alive while the batch is in use. A column has N entries, or one entry for all queries,
// or no entries. Brackets such as [+inf] show the default of a column without entries, or of a field that is 0. N is
// the number of queries of the block, which is the length of the first column of its kind.
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
#include "core/geometry/ray.h"

namespace locus {

enum class Source : uint8_t { kBoth, kStatic, kDynamic };
enum class Precision : uint8_t { kExact, kConservative };
enum class OutsideHistory : uint8_t { kReject, kClamp };
enum class RayMode : uint8_t { kFirst, kAny, kAll };
enum class StaticDetail : uint8_t { kInstances, kTriangles, kTrianglesSorted };

// Result columns that a block may request. Values equal those of the protocol's Column.
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
};
inline constexpr Column kLastColumn = Column::kPose;

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

struct RayColumns {
  absl::Span<const float> origins;     // 3N, relative to the frame
  absl::Span<const float> directions;  // 3N or 3, not zero
  absl::Span<const float> t_max;       // [+inf], >= 0
  RayMode mode = RayMode::kFirst;
  Cull cull = Cull::kNone;
  Inside inside = Inside::kSolid;
};

struct BallColumns {
  absl::Span<const float> centers;  // 3N
  absl::Span<const float> radii;    // N or 1, >= 0
  StaticDetail detail = StaticDetail::kInstances;
};

struct BoxColumns {
  absl::Span<const float> centers;       // 3N
  absl::Span<const float> half_extents;  // 3N or 3, >= 0
  absl::Span<const float> rotations;     // [identity], 4N or 4: x y z w
  StaticDetail detail = StaticDetail::kInstances;
};

struct NearestColumns {
  absl::Span<const float> points;         // 3N
  absl::Span<const float> max_distances;  // [+inf], >= 0
  uint32_t count = 0;                     // maximum number of rows per query [1]
  StaticDetail detail = StaticDetail::kInstances;
};

// Lookup by ids (one row per id) or by groups (a count per group, and that many rows); exactly one of them is given.
struct LookupColumns {
  absl::Span<const uint64_t> ids;
  absl::Span<const uint64_t> groups;
};

struct QueryBlock {
  Vec3d frame;
  Source source = Source::kBoth;
  Precision precision = Precision::kExact;
  ColumnSet columns;                         // [default columns of the kind]
  absl::Span<const uint32_t> masks;          // [all layers]
  absl::Span<const uint64_t> ignore_groups;  // [0 = none]
  absl::Span<const uint64_t> ignore_ids;     // for the whole block
  uint32_t max_results = 0;                  // [limits::kDefaultMaxResults]
  Id after_id = kNoId;                       // balls, boxes and groups: return only ids above this
  absl::Span<const uint64_t> as_of_ticks;    // [now]
  absl::Span<const float> as_of_fractions;   // [0], 0 <= f < 1; only with as_of_ticks
  OutsideHistory outside = OutsideHistory::kReject;
  std::variant<RayColumns, BallColumns, BoxColumns, LookupColumns, NearestColumns> kind;
};

// Returns the kind of the block. The values of BlockKind equal the indices of the variant's alternatives, as asserted
// below.
constexpr BlockKind block_kind(const QueryBlock& block) { return static_cast<BlockKind>(block.kind.index()); }
template <BlockKind kKind>
using ColumnsOf = std::variant_alternative_t<static_cast<size_t>(kKind), decltype(QueryBlock::kind)>;
static_assert(std::is_same_v<ColumnsOf<BlockKind::kRay>, RayColumns>);
static_assert(std::is_same_v<ColumnsOf<BlockKind::kBall>, BallColumns>);
static_assert(std::is_same_v<ColumnsOf<BlockKind::kBox>, BoxColumns>);
static_assert(std::is_same_v<ColumnsOf<BlockKind::kLookup>, LookupColumns>);
static_assert(std::is_same_v<ColumnsOf<BlockKind::kNearest>, NearestColumns>);
static_assert(std::variant_size_v<decltype(QueryBlock::kind)> == kBlockKinds);

struct QueryBatch {
  std::vector<QueryBlock> blocks;
  uint64_t max_work = 0;         // nodes, cells and primitive tests of the whole batch [no limit]
  uint32_t max_reply_bytes = 0;  // [limits::kDefaultReplyBytes]
};

// Returns the number of queries of a block.
size_t query_count(const QueryBlock& block);

// Checks untrusted columns completely: lengths, limits and every value. Returns INVALID_ARGUMENT (or RESOURCE_EXHAUSTED
// for a limit) that names the field, such as blocks[2].rays.directions, and the index of the query.
absl::Status check_batch(const QueryBatch& batch);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_QUERY_BATCH_H_
