#include "server/scheduling/cost_estimates.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <tuple>

#include "core/base/check.h"

namespace locus::server {
namespace {

// Fixed cost of a block, in nanoseconds, in addition to the cost of its queries.
constexpr double kBlockNanoseconds = 500;
// Estimated nanoseconds of a query (for sight, of a segment) before the first measurement, indexed by CostKind.
// Measured on scenes of 100,000 triangles and 10,000 objects.
constexpr std::array<double, 15> kFirstGuess = {300,  200,  1000, 1000, 1000, 2000,       100,   20'000,
                                                5000, 2000, 5000, 200,  1000, 50'000'000, 20'000};
static_assert(kFirstGuess.size() == static_cast<size_t>(CostKind::kCell) + 1);
// Estimated nanoseconds of one test of a query by list before the first measurement.
constexpr double kFirstGuessOfTest = 5;
constexpr double kMin = 1, kMax = 1e12;
constexpr double kMinOfTest = 1e-3;
constexpr size_t kProbes = 8;
// A measurement of n queries has the weight n / kForgetQueries in the new estimate, clamped to kMinWeight ..
// kMaxWeight.
constexpr double kForgetQueries = 2048;
constexpr double kMinWeight = 1.0 / 64, kMaxWeight = 0.5;

uint64_t mix(uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

struct KindOf {
  CostKind operator()(const RayColumns& rays) const {
    if (rays.mode == RayMode::kAll) return CostKind::kRayAll;
    return rays.mode == RayMode::kAny ? CostKind::kRayAny : CostKind::kRayFirst;
  }
  CostKind operator()(const BallColumns&) const { return CostKind::kBall; }
  CostKind operator()(const BoxColumns&) const { return CostKind::kBox; }
  CostKind operator()(const CapsuleColumns&) const { return CostKind::kCapsule; }
  CostKind operator()(const SweepColumns&) const { return CostKind::kSweep; }
  CostKind operator()(const FrustumColumns&) const { return CostKind::kFrustum; }
  CostKind operator()(const SightColumns&) const { return CostKind::kSight; }
  CostKind operator()(const ContainsColumns&) const { return CostKind::kContains; }
  CostKind operator()(const PairColumns&) const { return CostKind::kPairs; }
  CostKind operator()(const CellColumns&) const { return CostKind::kCell; }
  CostKind operator()(const NearestColumns&) const { return CostKind::kNearest; }
  CostKind operator()(const LookupColumns& lookup) const {
    return lookup.groups.empty() ? CostKind::kLookup : CostKind::kLookupGroups;
  }
};

// Returns the number of tests of one query by list. A query of pairs tests all values for each value.
double tests_of(CostKind kind, CostEstimates::ListValues values) {
  const auto tests = static_cast<double>(values);
  return kind == CostKind::kPairs ? tests * tests : tests;
}

// Returns the number of units of the block's cost: its queries or, for sight, its segments.
double units_of(const QueryBlock& block) {
  const auto* const sight = std::get_if<SightColumns>(&block.kind);
  const auto queries = static_cast<double>(query_count(block));
  if (sight == nullptr) return queries;
  return queries *
         static_cast<double>(sight->eyes_per_viewer() * sight->samples_per_target() * sight->bytes_per_viewer());
}

uint64_t packed(uint32_t tag, double nanoseconds) {
  return uint64_t{tag} << 32 | std::bit_cast<uint32_t>(static_cast<float>(nanoseconds));
}
uint32_t tag_of(uint64_t entry) { return static_cast<uint32_t>(entry >> 32); }
double nanoseconds_of(uint64_t entry) { return std::bit_cast<float>(static_cast<uint32_t>(entry)); }

}  // namespace

CostKind cost_kind(const QueryBlock& block) { return std::visit(KindOf(), block.kind); }

absl::string_view cost_kind_name(CostKind kind) {
  static constexpr std::array<absl::string_view, 15> kNames = {
      "rays_first", "rays_any", "rays_all", "balls", "boxes",    "nearest", "lookup", "lookup_groups",
      "capsules",   "sweeps",   "frustums", "sight", "contains", "pairs",   "cells"};
  return kNames[static_cast<size_t>(kind)];
}

CostEstimates::Slot CostEstimates::slot_of(uint64_t scene, CostKind kind, Source source, bool by_list) {
  const uint64_t sort = static_cast<uint64_t>(kind) * 8 + static_cast<uint64_t>(source) * 2 + (by_list ? 1 : 0);
  const uint64_t hash = mix(mix(scene) + sort);
  return {hash % kEntries, static_cast<uint32_t>(hash >> 32) | 1u};
}

size_t CostEstimates::find(const Slot& slot) const {
  LOCUS_DCHECK_LT(slot.first, kEntries);
  LOCUS_DCHECK_NE(slot.tag, 0u);
  size_t empty = slot.first;
  for (size_t i = kProbes; i-- > 0;) {
    const size_t index = (slot.first + i) % kEntries;
    const uint64_t entry = entries_[index].load(std::memory_order_relaxed);
    if (tag_of(entry) == slot.tag) return index;
    if (entry == 0) empty = index;
  }
  return empty;
}

double CostEstimates::nanoseconds_a_query(uint64_t scene, const QueryBlock& block, ListValues values) const {
  const Slot slot = slot_of(scene, block, values != 0);
  const uint64_t entry = entries_[find(slot)].load(std::memory_order_relaxed);
  const bool known = tag_of(entry) == slot.tag;
  if (values != 0) return tests_of(cost_kind(block), values) * (known ? nanoseconds_of(entry) : kFirstGuessOfTest);
  return known ? nanoseconds_of(entry) : kFirstGuess[static_cast<size_t>(cost_kind(block))];
}

uint64_t CostEstimates::nanoseconds(uint64_t scene, const QueryBatch& batch, ListValues values) const {
  double sum = 0;
  for (const QueryBlock& block : batch.blocks)
    sum += kBlockNanoseconds + units_of(block) * nanoseconds_a_query(scene, block, values);
  return static_cast<uint64_t>(std::min(sum, kMax));
}

void CostEstimates::learn(uint64_t scene, const QueryBlock& block, uint64_t nanoseconds, ListValues values,
                          uint64_t work) {
  const double queries = units_of(block);
  if (queries == 0) return;
  const double units = values == 0 ? queries : queries * tests_of(cost_kind(block), values);
  const double seen = std::clamp(static_cast<double>(nanoseconds) / units, values == 0 ? kMin : kMinOfTest, kMax);
  const Slot slot = slot_of(scene, block, values != 0);
  const size_t index = find(slot);
  std::atomic<uint64_t>& at = entries_[index];
  uint64_t before = at.load(std::memory_order_relaxed);
  const double weight = std::clamp(queries / kForgetQueries, kMinWeight, kMaxWeight);
  const double known = nanoseconds_of(before);
  const double now = tag_of(before) == slot.tag ? known + (seen - known) * weight : seen;
  LOCUS_DCHECK(kMinOfTest / 2 <= now && now <= 2 * kMax);
  at.compare_exchange_strong(before, packed(slot.tag, now), std::memory_order_relaxed);
  const uint64_t last = works_[index].load(std::memory_order_relaxed);
  const double worked = static_cast<double>(work) / units, past = nanoseconds_of(last);
  const double mean = tag_of(last) == slot.tag ? past + (worked - past) * weight : worked;
  works_[index].store(packed(slot.tag, mean), std::memory_order_relaxed);
}

std::vector<KindCost> CostEstimates::learned(uint64_t scene, ListValues values) const {
  std::vector<KindCost> costs;
  for (size_t kind = 0; kind < kFirstGuess.size(); ++kind) {
    for (const Source source : {Source::kBoth, Source::kStatic, Source::kDynamic}) {
      for (const bool by_list : {false, true}) {
        KindCost cost{static_cast<CostKind>(kind), source, by_list, 0, 0};
        const Slot slot = slot_of(scene, cost.kind, source, by_list);
        const size_t index = find(slot);
        const uint64_t entry = entries_[index].load(std::memory_order_relaxed);
        const uint64_t work = works_[index].load(std::memory_order_relaxed);
        if (tag_of(entry) != slot.tag) continue;
        const double units = by_list ? tests_of(cost.kind, values) : 1;
        cost.nanoseconds = units * nanoseconds_of(entry);
        if (tag_of(work) == slot.tag) cost.work = units * nanoseconds_of(work);
        costs.push_back(cost);
      }
    }
  }
  const auto order = [](const KindCost& cost) {
    return std::tuple(cost_kind_name(cost.kind), cost.source, cost.by_list);
  };
  std::sort(costs.begin(), costs.end(), [&](const KindCost& a, const KindCost& b) { return order(a) < order(b); });
  return costs;
}

}  // namespace locus::server
