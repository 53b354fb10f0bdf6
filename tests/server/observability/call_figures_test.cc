#include "server/observability/call_figures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/refusal.h"

namespace locus::server {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string text_of(const CallMetrics& metrics) {
  MetricPage page;
  add_call_figures(metrics.read(), page);
  return page.text();
}

TEST(CallFiguresTest, CountersAreLabelledByRpcKindAndReason) {
  CallMetrics metrics;
  metrics.record_call(Rpc::kQuery, absl::StatusCode::kOk, 1500);
  metrics.record_call(Rpc::kQuery, absl::StatusCode::kResourceExhausted, 1500);
  metrics.record_block(BlockKind::kBall, 64, 2000, {.nodes = 1, .cells = 2, .tests = 3});
  metrics.record_update(12, 5000);
  metrics.record_mesh_build(1'000'000);
  metrics.record_instance_change(1'000'000);
  metrics.record_refusal(refuse_full("", "calls", 1, 2, 100));
  const OpenStream open(metrics, Rpc::kStreamUpdates);
  const std::string text = text_of(metrics);
  for (const char* line :
       {"locus_calls_total{rpc=\"Query\",code=\"OK\"} 1\n",
        "locus_calls_total{rpc=\"Query\",code=\"RESOURCE_EXHAUSTED\"} 1\n",
        "locus_call_seconds_count{rpc=\"Query\"} 2\n", "locus_call_seconds_sum{rpc=\"Query\"} 3e-06\n",
        "locus_queries_total{kind=\"ball\"} 64\n", "locus_query_work_total{kind=\"ball\",unit=\"nodes\"} 1\n",
        "locus_query_work_total{kind=\"ball\",unit=\"cells\"} 2\n",
        "locus_query_work_total{kind=\"ball\",unit=\"tests\"} 3\n",
        "locus_query_block_seconds_count{kind=\"ball\"} 1\n", "locus_update_items_total 12\n",
        "locus_update_lag_seconds_count 1\n", "locus_mesh_build_seconds_count 1\n",
        "locus_instance_change_seconds_count 1\n", "locus_refusals_total{reason=\"LIMIT\",limit=\"calls\"} 1\n",
        "locus_streams_open{rpc=\"StreamUpdates\"} 1\n", "locus_streams_open{rpc=\"StreamQueries\"} 0\n"})
    EXPECT_THAT(text, HasSubstr(line));
}

TEST(CallFiguresTest, AnRpcWithoutCallsHasCountZeroAndNoHistogram) {
  const std::string text = text_of(CallMetrics());
  EXPECT_THAT(text, HasSubstr("locus_calls_total{rpc=\"DumpScene\",code=\"OK\"} 0\n"));
  EXPECT_THAT(text, Not(HasSubstr("locus_call_seconds_bucket")));
}

}  // namespace
}  // namespace locus::server
