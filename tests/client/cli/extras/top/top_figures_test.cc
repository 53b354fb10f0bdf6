#include "client/cli/extras/top/top_figures.h"

#include <gtest/gtest.h>

#include <string>

namespace locus::cli {
namespace {

std::vector<MetricSample> samples(const std::string& text) {
  auto read = parse_metrics(text);
  EXPECT_TRUE(read.ok()) << read.status();
  return *std::move(read);
}

TEST(TopFiguresTest, CountersBecomeRates) {
  const TopFigures figures =
      top_figures(samples("locus_queries_total{kind=\"ray\"} 1000\nlocus_query_block_seconds_sum{kind=\"ray\"} 1\n"
                          "locus_scene_revision{scene=\"arena\"} 10\nlocus_refusals_total{reason=\"LIMIT\"} 1\n"),
                  samples("locus_queries_total{kind=\"ray\"} 5000\nlocus_query_block_seconds_sum{kind=\"ray\"} 1.5\n"
                          "locus_scene_revision{scene=\"arena\"} 70\nlocus_scene_objects{scene=\"arena\"} 12\n"
                          "locus_refusals_total{reason=\"LIMIT\"} 3\nlocus_ready 1\n"),
                  2);
  EXPECT_EQ(figures.queries[0], (Json{{"kind", "ray"}, {"per_s", 2000}, {"us_each", 125}}));
  EXPECT_EQ(figures.scenes[0]["scene"], "arena");
  EXPECT_EQ(figures.scenes[0]["revisions_per_s"], 30);
  EXPECT_EQ(figures.scenes[0]["objects"], 12);
  EXPECT_EQ(figures.server["refusals_per_s"], 1);
  EXPECT_EQ(figures.server["ready"], true);
}

TEST(TopFiguresTest, QuantilesOfTheIntervalAreInterpolatedWithinTheirBucket) {
  const TopFigures figures = top_figures(
      samples("locus_calls_total{rpc=\"Query\",code=\"OK\"} 100\n"
              "locus_call_seconds_bucket{rpc=\"Query\",le=\"0.001\"} 100\n"
              "locus_call_seconds_bucket{rpc=\"Query\",le=\"0.002\"} 100\n"
              "locus_call_seconds_bucket{rpc=\"Query\",le=\"+Inf\"} 100\n"),
      samples(
          "locus_calls_total{rpc=\"Query\",code=\"OK\"} 198\n"
          "locus_calls_total{rpc=\"Query\",code=\"NOT_FOUND\"} 2\nlocus_calls_total{rpc=\"GetScene\",code=\"OK\"} 0\n"
          "locus_call_seconds_bucket{rpc=\"Query\",le=\"0.001\"} 100\n"
          "locus_call_seconds_bucket{rpc=\"Query\",le=\"0.002\"} 200\n"
          "locus_call_seconds_bucket{rpc=\"Query\",le=\"+Inf\"} 200\n"),
      1);
  ASSERT_EQ(figures.rpcs.size(), 1u);
  EXPECT_EQ(figures.rpcs[0], (Json{{"rpc", "Query"}, {"per_s", 100}, {"p50_ms", 1.5}, {"p99_ms", 1.99}}));
}

TEST(TopFiguresTest, AQuantileInTheLastBucketIsItsLowerBound) {
  const TopFigures figures = top_figures({},
                                         samples("locus_calls_total{rpc=\"Query\",code=\"OK\"} 1\n"
                                                 "locus_call_seconds_bucket{rpc=\"Query\",le=\"2\"} 0\n"
                                                 "locus_call_seconds_bucket{rpc=\"Query\",le=\"+Inf\"} 1\n"),
                                         1);
  EXPECT_EQ(figures.rpcs[0]["p99_ms"], 2000);
}

TEST(TopFiguresTest, ACounterThatFellHasNoRate) {
  const TopFigures figures = top_figures(samples("locus_queries_total{kind=\"ray\"} 1000\n"),
                                         samples("locus_queries_total{kind=\"ray\"} 5\n"), 1);
  EXPECT_EQ(figures.queries[0]["per_s"], nullptr);
  EXPECT_EQ(figures.queries[0]["us_each"], nullptr);
}

TEST(TopFiguresTest, ANewSceneHasARevisionRateOfZero) {
  EXPECT_EQ(top_figures({}, samples("locus_scene_revision{scene=\"arena\"} 70\n"), 1).scenes[0]["revisions_per_s"], 0);
}

TEST(TopFiguresTest, AnEmptyPageGivesNoRows) {
  const TopFigures figures = top_figures({}, {}, 1);
  EXPECT_TRUE(figures.rpcs.empty() && figures.queries.empty() && figures.scenes.empty());
  EXPECT_EQ(figures.server["ready"], false);
}

TEST(TopFiguresTest, AMemberOfAClusterShowsItsRolesMembersAndEngine) {
  const TopFigures figures = top_figures(samples("locus_cluster_append_seconds_bucket{le=\"0.001\"} 0\n"
                                                 "locus_cluster_append_seconds_bucket{le=\"+Inf\"} 0\n"),
                                         samples("locus_scene_revision{scene=\"arena\"} 70\n"
                                                 "locus_scene_revision{scene=\"yard\"} 2\n"
                                                 "locus_scene_revision{scene=\"_other\"} 9\n"
                                                 "locus_scene_leading{scene=\"arena\"} 1\n"
                                                 "locus_scene_leading{scene=\"yard\"} 0\n"
                                                 "locus_scene_leading{scene=\"_other\"} 3\n"
                                                 "locus_cluster_members 3\nlocus_cluster_leading 4\n"
                                                 "locus_cluster_engine_up 0\n"
                                                 "locus_cluster_append_seconds_bucket{le=\"0.001\"} 100\n"
                                                 "locus_cluster_append_seconds_bucket{le=\"+Inf\"} 100\n"),
                                         1);
  ASSERT_EQ(figures.scenes.size(), 3u);
  EXPECT_EQ(figures.scenes[0]["role"], nullptr) << "the sum over several scenes";
  EXPECT_EQ(figures.scenes[1]["role"], "leading");
  EXPECT_EQ(figures.scenes[2]["role"], "no_leader");
  EXPECT_EQ(figures.server["members"], 3);
  EXPECT_EQ(figures.server["leading"], 4);
  EXPECT_EQ(figures.server["engine_up"], false);
  EXPECT_EQ(figures.server["append_p99_ms"], 0.99);
}

TEST(TopFiguresTest, AServerWithoutAClusterShowsNothingOfOne) {
  const TopFigures figures = top_figures({}, samples("locus_scene_revision{scene=\"arena\"} 70\nlocus_ready 1\n"), 1);
  EXPECT_FALSE(figures.scenes[0].contains("role"));
  for (const char* const key : {"members", "leading", "engine_up", "append_p99_ms"})
    EXPECT_FALSE(figures.server.contains(key)) << key;
}

}  // namespace
}  // namespace locus::cli
