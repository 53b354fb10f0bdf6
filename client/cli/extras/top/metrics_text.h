// Prometheus's text format as plain data. The text comes from whoever listens at an address, so everything is checked
// and bounded. Functions without state.
//
// Source: Prometheus documentation, "Exposition formats", text-based format version 0.0.4.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TOP_METRICS_TEXT_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TOP_METRICS_TEXT_H_

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::cli {

inline constexpr size_t kMaxMetricSamples = 200'000;
inline constexpr size_t kMaxMetricLineBytes = 4096;
inline constexpr size_t kMaxMetricLabels = 16;  // of one sample

struct MetricSample {
  std::string name;
  std::vector<std::pair<std::string, std::string>> labels;
  double value = 0;

  // Empty where there is no such label.
  absl::string_view label(absl::string_view key) const;
};

// Every sample, in order; comments and times are passed over. INVALID_ARGUMENT naming the line where one is not of the
// format, RESOURCE_EXHAUSTED for more than the maxima above.
absl::StatusOr<std::vector<MetricSample>> parse_metrics(absl::string_view text);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TOP_METRICS_TEXT_H_
