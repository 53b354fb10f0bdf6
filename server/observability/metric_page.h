// A page of metrics as it is put together for one scrape, and its text in Prometheus's exposition format. The only
// place that knows prometheus-cpp, which writes the format and escapes what stands in it. Not thread-safe.
//
// Invariant: a name is begun once, and every name says in HELP what it counts, in which unit.
#ifndef LOCUS_SERVER_OBSERVABILITY_METRIC_PAGE_H_
#define LOCUS_SERVER_OBSERVABILITY_METRIC_PAGE_H_

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/observability/latency_histogram.h"

namespace locus::server {

enum class MetricKind : uint8_t { kCounter, kGauge, kHistogram };

// Names are ours; values may be anything.
using MetricLabels = std::vector<std::pair<std::string, std::string>>;

class MetricPage {
 public:
  // What the HTTP reply calls this text.
  static constexpr const char* kContentType = "text/plain; version=0.0.4; charset=utf-8";

  MetricPage();
  ~MetricPage();
  MetricPage(const MetricPage&) = delete;
  MetricPage& operator=(const MetricPage&) = delete;

  // What is added from here on belongs to `name`.
  void begin(const std::string& name, const std::string& help, MetricKind kind);
  // To a counter or gauge.
  void add(const MetricLabels& labels, double value);
  // To a histogram, in seconds.
  void add(const MetricLabels& labels, const LatencyCounts& counts);

  // A counter or gauge without labels.
  void add_one(const std::string& name, const std::string& help, MetricKind kind, double value);

  std::string text() const;

 private:
  struct Families;
  std::unique_ptr<Families> families_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_METRIC_PAGE_H_
