// A page of metrics for one scrape, and its text in Prometheus's exposition format. Only metric_page.cc includes
// prometheus-cpp, which writes the format and escapes values. Not thread-safe.
//
// Invariant: begin() is called once for each metric name, with a HELP text that says the metric's meaning and unit.
#ifndef LOCUS_SERVER_OBSERVABILITY_METRIC_PAGE_H_
#define LOCUS_SERVER_OBSERVABILITY_METRIC_PAGE_H_

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/observability/latency_histogram.h"

namespace locus::server {

enum class MetricKind : uint8_t { kCounter, kGauge, kHistogram };

// List of pairs: a label's name, which is a constant of this program, and the label's value, which may be any text.
using MetricLabels = std::vector<std::pair<std::string, std::string>>;

class MetricPage {
 public:
  // Content type of text() in an HTTP reply.
  static constexpr const char* kContentType = "text/plain; version=0.0.4; charset=utf-8";

  MetricPage();
  ~MetricPage();
  MetricPage(const MetricPage&) = delete;
  MetricPage& operator=(const MetricPage&) = delete;

  // Begins the metric `name`: later calls of add() add samples to this metric. Precondition: no earlier call of begin()
  // had this name.
  void begin(const std::string& name, const std::string& help, MetricKind kind);
  // Adds a sample to the current metric, which must be a counter or gauge.
  void add(const MetricLabels& labels, double value);
  // Adds the counts, converted to seconds, to the current metric, which must be a histogram.
  void add(const MetricLabels& labels, const LatencyCounts& counts);

  // Adds a counter or gauge with one sample without labels.
  void add_one(const std::string& name, const std::string& help, MetricKind kind, double value);

  std::string text() const;

 private:
  struct Families;
  std::unique_ptr<Families> families_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_METRIC_PAGE_H_
