#include "server/observability/metric_page.h"

#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>

#include <limits>

#include "core/base/check.h"

namespace locus::server {
namespace {

constexpr double kSecondsANanosecond = 1e-9;

prometheus::MetricType type_of(MetricKind kind) {
  switch (kind) {
    case MetricKind::kCounter:
      return prometheus::MetricType::Counter;
    case MetricKind::kGauge:
      return prometheus::MetricType::Gauge;
    case MetricKind::kHistogram:
      return prometheus::MetricType::Histogram;
  }
  return prometheus::MetricType::Untyped;
}

prometheus::ClientMetric labelled(const MetricLabels& labels) {
  prometheus::ClientMetric metric;
  for (const auto& [name, value] : labels) metric.label.push_back({name, value});
  return metric;
}

}  // namespace

struct MetricPage::Families {
  std::vector<prometheus::MetricFamily> all;
};

MetricPage::MetricPage() : families_(std::make_unique<Families>()) {}
MetricPage::~MetricPage() = default;

void MetricPage::begin(const std::string& name, const std::string& help, MetricKind kind) {
  for (const prometheus::MetricFamily& other : families_->all) LOCUS_CHECK(other.name != name);
  LOCUS_DCHECK(!help.empty());
  families_->all.push_back({name, help, type_of(kind), {}});
}

void MetricPage::add(const MetricLabels& labels, double value) {
  LOCUS_CHECK(!families_->all.empty());
  prometheus::MetricFamily& family = families_->all.back();
  LOCUS_CHECK(family.type != prometheus::MetricType::Histogram);
  prometheus::ClientMetric metric = labelled(labels);
  if (family.type == prometheus::MetricType::Counter) {
    metric.counter.value = value;
  } else {
    metric.gauge.value = value;
  }
  family.metric.push_back(std::move(metric));
}

void MetricPage::add(const MetricLabels& labels, const LatencyCounts& counts) {
  LOCUS_CHECK(!families_->all.empty());
  prometheus::MetricFamily& family = families_->all.back();
  LOCUS_CHECK(family.type == prometheus::MetricType::Histogram);
  prometheus::ClientMetric metric = labelled(labels);
  prometheus::ClientMetric::Histogram& histogram = metric.histogram;
  uint64_t sum = 0;
  for (size_t range = 0; range < counts.ranges.size(); ++range) {
    sum += counts.ranges[range];
    const double bound = range < kLatencyBounds ? static_cast<double>(latency_bound(range)) * kSecondsANanosecond
                                                : std::numeric_limits<double>::infinity();
    histogram.bucket.push_back({sum, bound});
  }
  histogram.sample_count = sum;
  histogram.sample_sum = static_cast<double>(counts.nanoseconds) * kSecondsANanosecond;
  family.metric.push_back(std::move(metric));
}

void MetricPage::add_one(const std::string& name, const std::string& help, MetricKind kind, double value) {
  begin(name, help, kind);
  add({}, value);
}

std::string MetricPage::text() const { return prometheus::TextSerializer().Serialize(families_->all); }

}  // namespace locus::server
