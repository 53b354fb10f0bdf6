// Parser of the Prometheus text format into plain data. The text comes from an untrusted server, so its syntax is
// checked and its size is bounded. Functions without state.
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
inline constexpr size_t kMaxMetricLabels = 16;  // maximum number of labels of one sample

struct MetricSample {
  std::string name;
  std::vector<std::pair<std::string, std::string>> labels;
  double value = 0;

  // Returns the value of the label `key`, or an empty string if the sample has no such label.
  absl::string_view label(absl::string_view key) const;
};

// Returns all samples in the order of the text, without comments and timestamps. Returns INVALID_ARGUMENT, with the
// number of the line, if a line is not in the format or has more than kMaxMetricLabels labels. Returns
// RESOURCE_EXHAUSTED if the text exceeds kMaxMetricSamples or kMaxMetricLineBytes.
absl::StatusOr<std::vector<MetricSample>> parse_metrics(absl::string_view text);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TOP_METRICS_TEXT_H_
