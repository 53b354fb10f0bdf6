// Kinds of queries that a block of a batch has, for all rooms: what the core answers, the server counts and logs. Plain
// data.
#ifndef LOCUS_CORE_BASE_BLOCK_KIND_H_
#define LOCUS_CORE_BASE_BLOCK_KIND_H_

#include <array>
#include <cstddef>
#include <cstdint>

#include "absl/strings/string_view.h"

namespace locus {

// In the order of the alternatives of QueryBlock::kind, which core/query/query_batch.h asserts.
enum class BlockKind : uint8_t { kRay, kBall, kBox, kLookup, kNearest };

// Names by number, as metrics and logs spell them.
inline constexpr std::array<absl::string_view, 5> kBlockKindNames = {"ray", "ball", "box", "lookup", "nearest"};
inline constexpr size_t kBlockKinds = kBlockKindNames.size();
static_assert(kBlockKinds == static_cast<size_t>(BlockKind::kNearest) + 1);

constexpr absl::string_view block_kind_name(BlockKind kind) { return kBlockKindNames[static_cast<size_t>(kind)]; }

}  // namespace locus

#endif  // LOCUS_CORE_BASE_BLOCK_KIND_H_
