// Kinds of queries: each block of a query batch holds queries of one kind. The core has one implementation per kind;
// the server counts and logs queries per kind. Plain data.
#ifndef LOCUS_CORE_BASE_BLOCK_KIND_H_
#define LOCUS_CORE_BASE_BLOCK_KIND_H_

#include <array>
#include <cstddef>
#include <cstdint>

#include "absl/strings/string_view.h"

namespace locus {

// Kind of the queries of a block, in the order of the alternatives of QueryBlock::kind; core/query/query_batch.h
// asserts this order.
enum class BlockKind : uint8_t {
  kRay,
  kBall,
  kBox,
  kLookup,
  kNearest,
  kCapsule,
  kSweep,
  kFrustum,
  kSight,
  kContains,
  kPairs,
  kCell
};

// Names of the kinds, indexed by BlockKind, as they appear in metrics and logs.
inline constexpr std::array<absl::string_view, 12> kBlockKindNames = {
    "ray", "ball", "box", "lookup", "nearest", "capsule", "sweep", "frustum", "sight", "contains", "pairs", "cell"};
inline constexpr size_t kBlockKinds = kBlockKindNames.size();
static_assert(kBlockKinds == static_cast<size_t>(BlockKind::kCell) + 1);

constexpr absl::string_view block_kind_name(BlockKind kind) { return kBlockKindNames[static_cast<size_t>(kind)]; }

}  // namespace locus

#endif  // LOCUS_CORE_BASE_BLOCK_KIND_H_
