#include "server/observability/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/refusal.h"
#include "server/config/observability_limits.h"

namespace locus::server {
namespace {

using ::testing::ElementsAre;
using ::testing::Pair;

const RpcCounts& of(const MetricCounts& counts, Rpc rpc) { return counts.rpcs[static_cast<size_t>(rpc)]; }

TEST(MetricsTest, CallsAreCountedByRpcAndCode) {
  CallMetrics metrics;
  metrics.record_call(Rpc::kQuery, absl::StatusCode::kOk, 2000);
  metrics.record_call(Rpc::kQuery, absl::StatusCode::kOk, 3000);
  metrics.record_call(Rpc::kQuery, absl::StatusCode::kNotFound, 1);
  metrics.record_call(Rpc::kStreamQueries, absl::StatusCode::kUnauthenticated, 1);
  const MetricCounts counts = metrics.read();
  EXPECT_EQ(of(counts, Rpc::kQuery).codes[0], 2u);
  EXPECT_EQ(of(counts, Rpc::kQuery).codes[5], 1u);
  EXPECT_EQ(of(counts, Rpc::kQuery).latency.count(), 3u);
  EXPECT_EQ(of(counts, Rpc::kQuery).latency.nanoseconds, 5001u);
  EXPECT_EQ(of(counts, Rpc::kStreamQueries).codes[16], 1u);
  EXPECT_EQ(of(counts, Rpc::kGetServer).latency.count(), 0u);
}

TEST(MetricsTest, AnUnknownCodeCountsAsUnknown) {
  CallMetrics metrics;
  metrics.record_call(Rpc::kQuery, static_cast<absl::StatusCode>(99), 1);
  EXPECT_EQ(of(metrics.read(), Rpc::kQuery).codes[2], 1u);
}

TEST(MetricsTest, QueriesAndTheirWorkAreCountedByKind) {
  CallMetrics metrics;
  metrics.record_block(BlockKind::kRay, 1024, 50'000, {.nodes = 10, .cells = 20, .tests = 30});
  metrics.record_block(BlockKind::kRay, 1, 5'000, {.nodes = 1, .cells = 2, .tests = 3});
  metrics.record_block(BlockKind::kNearest, 7, 1, {});
  const MetricCounts counts = metrics.read();
  const QueryCounts& rays = counts.queries[static_cast<size_t>(BlockKind::kRay)];
  EXPECT_EQ(rays.queries, 1025u);
  EXPECT_EQ(rays.work.nodes, 11u);
  EXPECT_EQ(rays.work.cells, 22u);
  EXPECT_EQ(rays.work.tests, 33u);
  EXPECT_EQ(rays.latency.count(), 2u);
  EXPECT_EQ(rays.latency.nanoseconds, 55'000u);
  EXPECT_EQ(counts.queries[static_cast<size_t>(BlockKind::kNearest)].queries, 7u);
}

TEST(MetricsTest, CountsOfConcurrentThreadsAddUp) {
  constexpr uint64_t kThreads = 20;
  constexpr uint64_t kEach = 2000;
  CallMetrics metrics;
  std::vector<std::thread> threads;
  for (uint64_t i = 0; i < kThreads; ++i)
    threads.emplace_back([&metrics] {
      for (uint64_t j = 0; j < kEach; ++j) {
        metrics.record_call(Rpc::kApplyUpdates, absl::StatusCode::kOk, j);
        metrics.record_update(3, 1);
      }
    });
  for (std::thread& thread : threads) thread.join();
  const MetricCounts counts = metrics.read();
  EXPECT_EQ(of(counts, Rpc::kApplyUpdates).codes[0], kThreads * kEach);
  EXPECT_EQ(of(counts, Rpc::kApplyUpdates).latency.nanoseconds, kThreads * (kEach * (kEach - 1) / 2));
  EXPECT_EQ(counts.update_items, 3 * kThreads * kEach);
  EXPECT_EQ(counts.update_lag.count(), kThreads * kEach);
}

TEST(MetricsTest, RefusalsAreCountedByReasonAndLimitOrByCode) {
  CallMetrics metrics;
  metrics.record_refusal(refuse_full("", "calls", 256, 257, 100));
  metrics.record_refusal(refuse_full("", "calls", 256, 257, 100));
  metrics.record_refusal(refuse_argument(Reason::kNotFinite, "x", {}, "is no number"));
  metrics.record_refusal(absl::CancelledError("the caller gave up"));
  EXPECT_THAT(metrics.read().refusals, ElementsAre(Pair(Pair("CANCELLED", ""), 1u), Pair(Pair("LIMIT", "calls"), 2u),
                                                   Pair(Pair("NOT_FINITE", ""), 1u)));
}

TEST(MetricsTest, RefusalsBeyondTheMaximumOfNamesCountAsOther) {
  CallMetrics metrics;
  for (uint32_t i = 0; i < kMaxRefusalNames + 10; ++i)
    metrics.record_refusal(refuse_full("", absl::StrCat("limit", i), 1, 2, 0));
  metrics.record_refusal(refuse_full("", "limit0", 1, 2, 0));
  const MetricCounts counts = metrics.read();
  EXPECT_EQ(counts.refusals.size(), kMaxRefusalNames + 1);
  EXPECT_EQ(counts.refusals.at({"_other", "_other"}), 10u);
  EXPECT_EQ(counts.refusals.at({"LIMIT", "limit0"}), 2u);
}

TEST(MetricsTest, AStreamCountsAsOpenDuringItsLifetime) {
  CallMetrics metrics;
  {
    const OpenStream first(metrics, Rpc::kStreamQueries);
    const OpenStream second(metrics, Rpc::kStreamQueries);
    EXPECT_EQ(of(metrics.read(), Rpc::kStreamQueries).open, 2u);
    EXPECT_EQ(of(metrics.read(), Rpc::kStreamUpdates).open, 0u);
  }
  EXPECT_EQ(of(metrics.read(), Rpc::kStreamQueries).open, 0u);
}

TEST(MetricsTest, EveryRpcAndKindHasAUniqueName) {
  std::map<absl::string_view, int> names;
  for (size_t i = 0; i < kRpcs; ++i) ++names[rpc_name(static_cast<Rpc>(i))];
  for (size_t i = 0; i < kBlockKinds; ++i) ++names[block_kind_name(static_cast<BlockKind>(i))];
  EXPECT_EQ(names.size(), kRpcs + kBlockKinds);
  EXPECT_FALSE(names.contains(""));
}

}  // namespace
}  // namespace locus::server
