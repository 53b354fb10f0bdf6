#include "server/observability/metrics.h"

#include <optional>

#include "core/base/check.h"
#include "core/base/refusal.h"
#include "server/config/observability_limits.h"

namespace locus::server {
namespace {

constexpr auto kRelaxed = std::memory_order_relaxed;
constexpr const char* kOther = "_other";

RefusalName name_of(const absl::Status& status) {
  const std::optional<Refusal> refusal = refusal_of(status);
  if (!refusal || refusal->reason == Reason::kUnspecified) return {absl::StatusCodeToString(status.code()), ""};
  return {std::string(reason_name(refusal->reason)), refusal->limit};
}

}  // namespace

absl::string_view rpc_name(Rpc rpc) {
  static constexpr std::array<absl::string_view, kRpcs> kNames = {
      "GetServer",   "GetQuotas",    "Backup",        "MoveScene",  "CreateScene",   "GetScene",     "ListScenes",
      "DeleteScene", "UpdateScene",  "UploadMesh",    "ListMeshes", "DeleteMesh",    "DownloadMesh", "ChangeInstances",
      "DumpScene",   "ApplyUpdates", "StreamUpdates", "Query",      "StreamQueries", "Step"};
  LOCUS_DCHECK_LT(static_cast<size_t>(rpc), kRpcs);
  return kNames[static_cast<size_t>(rpc)];
}

CallMetrics::Stripe& CallMetrics::stripe() {
  static std::atomic<size_t> threads{0};
  thread_local const size_t kMine = threads.fetch_add(1, kRelaxed) % kStripes;
  return stripes_[kMine];
}

void CallMetrics::record_call(Rpc rpc, absl::StatusCode code, uint64_t nanoseconds) {
  LOCUS_DCHECK_LT(static_cast<size_t>(rpc), kRpcs);
  Stripe& mine = stripe();
  const auto value = static_cast<size_t>(code);
  // Count codes outside the known range as UNKNOWN.
  const size_t index = value < kStatusCodes ? value : static_cast<size_t>(absl::StatusCode::kUnknown);
  mine.codes[static_cast<size_t>(rpc)][index].fetch_add(1, kRelaxed);
  mine.calls[static_cast<size_t>(rpc)].record(nanoseconds);
}

void CallMetrics::record_block(BlockKind kind, uint64_t queries, uint64_t nanoseconds, const Work& work) {
  LOCUS_DCHECK_LT(static_cast<size_t>(kind), kBlockKinds);
  QueryStripe& mine = stripe().queries[static_cast<size_t>(kind)];
  mine.queries.fetch_add(queries, kRelaxed);
  mine.nodes.fetch_add(work.nodes, kRelaxed);
  mine.cells.fetch_add(work.cells, kRelaxed);
  mine.tests.fetch_add(work.tests, kRelaxed);
  mine.latency.record(nanoseconds);
}

void CallMetrics::record_update(uint64_t items, uint64_t nanoseconds) {
  Stripe& mine = stripe();
  mine.update_items.fetch_add(items, kRelaxed);
  mine.update_lag.record(nanoseconds);
}

void CallMetrics::record_mesh_build(uint64_t nanoseconds) { mesh_builds_.record(nanoseconds); }

void CallMetrics::record_instance_change(uint64_t nanoseconds) { instance_changes_.record(nanoseconds); }

void CallMetrics::record_refusal(const absl::Status& status) {
  LOCUS_DCHECK(!status.ok());
  RefusalName name = name_of(status);
  const MutexLock lock(mutex_);
  const bool room = refusals_.size() < kMaxRefusalNames || refusals_.contains(name);
  if (!room) name = {kOther, kOther};
  ++refusals_[std::move(name)];
  LOCUS_DCHECK_LE(refusals_.size(), kMaxRefusalNames + 1);  // one more for "_other"
}

MetricCounts CallMetrics::read() const {
  MetricCounts counts;
  for (const Stripe& stripe : stripes_) read(stripe, counts);
  for (size_t i = 0; i < kRpcs; ++i) counts.rpcs[i].open = open_streams_[i].load(kRelaxed);
  mesh_builds_.add_to(counts.mesh_builds);
  instance_changes_.add_to(counts.instance_changes);
  const MutexLock lock(mutex_);
  counts.refusals = refusals_;
  return counts;
}

void CallMetrics::read(const Stripe& stripe, MetricCounts& counts) const {
  for (size_t i = 0; i < kRpcs; ++i) {
    for (size_t code = 0; code < kStatusCodes; ++code)
      counts.rpcs[i].codes[code] += stripe.codes[i][code].load(kRelaxed);
    stripe.calls[i].add_to(counts.rpcs[i].latency);
  }
  for (size_t i = 0; i < kBlockKinds; ++i) {
    const QueryStripe& from = stripe.queries[i];
    QueryCounts& to = counts.queries[i];
    to.queries += from.queries.load(kRelaxed);
    to.work += Work{from.nodes.load(kRelaxed), from.cells.load(kRelaxed), from.tests.load(kRelaxed)};
    from.latency.add_to(to.latency);
  }
  counts.update_items += stripe.update_items.load(kRelaxed);
  stripe.update_lag.add_to(counts.update_lag);
}

}  // namespace locus::server
