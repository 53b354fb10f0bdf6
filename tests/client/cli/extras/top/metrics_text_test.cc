#include "client/cli/extras/top/metrics_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "absl/strings/str_cat.h"

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

TEST(MetricsTextTest, SamplesHaveNameLabelsAndValue) {
  const auto samples = parse_metrics(
      "# HELP locus_things Things.\n# TYPE locus_things gauge\n\n"
      "locus_things 3\n  locus_level{a=\"1\",b=\"two\",} -0.5\nlocus_time{} 1e3 1700000000000\r\n");
  ASSERT_TRUE(samples.ok()) << samples.status();
  ASSERT_EQ(samples->size(), 3u);
  EXPECT_EQ((*samples)[0].name, "locus_things");
  EXPECT_EQ((*samples)[0].value, 3);
  EXPECT_THAT((*samples)[1].labels, ElementsAre(Pair("a", "1"), Pair("b", "two")));
  EXPECT_EQ((*samples)[1].value, -0.5);
  EXPECT_EQ((*samples)[1].label("b"), "two");
  EXPECT_EQ((*samples)[1].label("c"), "");
  EXPECT_EQ((*samples)[2].value, 1000);
}

TEST(MetricsTextTest, EscapesAndSpecialNumbersAreRead) {
  const auto samples = parse_metrics("a{b=\"x\\\"y\\\\z\\n,}\"} +Inf\nc NaN\n");
  ASSERT_TRUE(samples.ok()) << samples.status();
  EXPECT_EQ((*samples)[0].labels[0].second, "x\"y\\z\n,}");
  EXPECT_EQ((*samples)[0].value, HUGE_VAL);
  EXPECT_TRUE(std::isnan((*samples)[1].value));
}

TEST(MetricsTextTest, MalformedTextIsRefusedNamingTheLine) {
  for (const char* line :
       {"<html>", "name", "name x", "name{a=\"1\" 2", "name{a=1} 2", "name{=\"1\"} 2", "name{a=\"1} 2", "name{a=\"\\",
        "1name 2", "name 1 2 3", "name 1 soon", "{} 1", "name{a \"1\"} 2"}) {
    const auto samples = parse_metrics(absl::StrCat("good 1\n", line, "\n"));
    EXPECT_EQ(samples.status().code(), absl::StatusCode::kInvalidArgument) << line;
    EXPECT_THAT(std::string(samples.status().message()), HasSubstr("line 2")) << line;
  }
}

TEST(MetricsTextTest, TextBeyondTheMaximaIsRefused) {
  EXPECT_EQ(parse_metrics(std::string(kMaxMetricLineBytes + 1, 'a')).status().code(),
            absl::StatusCode::kResourceExhausted);
  std::string labels;
  for (size_t i = 0; i <= kMaxMetricLabels; ++i) absl::StrAppend(&labels, "l", i, "=\"\",");
  EXPECT_FALSE(parse_metrics(absl::StrCat("a{", labels, "} 1")).ok());
  std::string many;
  for (size_t i = 0; i <= kMaxMetricSamples; ++i) many += "a 1\n";
  EXPECT_EQ(parse_metrics(many).status().code(), absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace locus::cli
