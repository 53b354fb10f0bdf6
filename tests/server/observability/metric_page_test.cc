#include "server/observability/metric_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::server {
namespace {

using ::testing::HasSubstr;

TEST(MetricPageTest, AFamilyHasItsHelpTypeAndSamples) {
  MetricPage page;
  page.begin("locus_things_total", "Things.", MetricKind::kCounter);
  page.add({{"kind", "ray"}}, 3);
  page.add({{"kind", "ball"}, {"of", "x"}}, 12345678901);
  page.add_one("locus_level", "A level.", MetricKind::kGauge, 0.5);
  EXPECT_EQ(page.text(),
            "# HELP locus_things_total Things.\n# TYPE locus_things_total counter\n"
            "locus_things_total{kind=\"ray\"} 3\nlocus_things_total{kind=\"ball\",of=\"x\"} 12345678901\n"
            "# HELP locus_level A level.\n# TYPE locus_level gauge\nlocus_level 0.5\n");
}

TEST(MetricPageTest, LabelsAreEscaped) {
  MetricPage page;
  page.begin("locus_things_total", "Things.", MetricKind::kCounter);
  page.add({{"name", "a\"b\\c\nd"}}, 1);
  EXPECT_THAT(page.text(), HasSubstr("{name=\"a\\\"b\\\\c\\nd\"} 1\n"));
}

TEST(MetricPageTest, HistogramBucketsAreCumulativeAndInSeconds) {
  LatencyHistogram histogram;
  histogram.record(1024);
  histogram.record(1'000'000);
  histogram.record(uint64_t{1} << 40);
  LatencyCounts counts;
  histogram.add_to(counts);
  MetricPage page;
  page.begin("locus_wait_seconds", "A wait.", MetricKind::kHistogram);
  page.add({{"rpc", "Query"}}, counts);
  const std::string text = page.text();
  EXPECT_THAT(text, HasSubstr("locus_wait_seconds_count{rpc=\"Query\"} 3\n"));
  EXPECT_THAT(text, HasSubstr("locus_wait_seconds_bucket{rpc=\"Query\",le=\"1.024e-06\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("locus_wait_seconds_bucket{rpc=\"Query\",le=\"0.001048576\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("locus_wait_seconds_bucket{rpc=\"Query\",le=\"17.179869184\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("locus_wait_seconds_bucket{rpc=\"Query\",le=\"+Inf\"} 3\n"));
}

TEST(MetricPageDeathTest, BeginningANameTwiceFails) {
  MetricPage page;
  page.begin("locus_level", "A level.", MetricKind::kGauge);
  EXPECT_DEATH(page.begin("locus_level", "Again.", MetricKind::kGauge), "other.name != name");
}

}  // namespace
}  // namespace locus::server
