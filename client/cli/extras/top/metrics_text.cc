#include "client/cli/extras/top/metrics_text.h"

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace locus::cli {
namespace {

bool is_name(char c, bool first) {
  return absl::ascii_isalpha(c) || c == '_' || c == ':' || (!first && absl::ascii_isdigit(c));
}

// Tokenizer of one line. `rest_` is the part of the line that has not been read. Each member function checks whether
// its kind of token is at the front of `rest_`, and removes the token if it is.
class Line {
 public:
  explicit Line(absl::string_view text) : rest_(text) {}

  std::string name() {
    size_t length = 0;
    while (length < rest_.size() && is_name(rest_[length], length == 0)) ++length;
    const std::string name(rest_.substr(0, length));
    rest_.remove_prefix(length);
    return name;
  }

  bool take(char c) {
    if (rest_.empty() || rest_.front() != c) return false;
    rest_.remove_prefix(1);
    return true;
  }

  void skip_spaces() { rest_ = absl::StripLeadingAsciiWhitespace(rest_); }

  // Consumes a quoted string, including both quotes, and appends its unescaped text to `value`.
  bool quoted(std::string* value) {
    if (!take('"')) return false;
    while (!rest_.empty()) {
      char c = rest_.front();
      rest_.remove_prefix(1);
      if (c == '"') return true;
      if (c == '\\') {
        if (rest_.empty()) return false;
        c = rest_.front() == 'n' ? '\n' : rest_.front();
        rest_.remove_prefix(1);
      }
      value->push_back(c);
    }
    return false;
  }

  absl::string_view rest() const { return rest_; }

 private:
  absl::string_view rest_;
};

bool read_labels(Line& line, MetricSample* sample) {
  while (!line.take('}')) {
    if (sample->labels.size() == kMaxMetricLabels) return false;
    std::string value;
    std::string key = line.name();
    if (key.empty() || !line.take('=') || !line.quoted(&value)) return false;
    sample->labels.emplace_back(std::move(key), std::move(value));
    line.take(',');
    line.skip_spaces();
  }
  return true;
}

// Parses a sample's value, which may be followed by a timestamp in milliseconds; the timestamp is ignored.
bool read_value(absl::string_view text, double* value) {
  const std::vector<absl::string_view> words = absl::StrSplit(text, absl::ByAnyChar(" \t"), absl::SkipEmpty());
  if (words.empty() || words.size() > 2 || !absl::SimpleAtod(words[0], value)) return false;
  int64_t time = 0;
  return words.size() == 1 || absl::SimpleAtoi(words[1], &time);
}

bool read_sample(absl::string_view text, MetricSample* sample) {
  Line line(text);
  sample->name = line.name();
  if (sample->name.empty()) return false;
  line.skip_spaces();
  if (line.take('{')) {
    line.skip_spaces();
    if (!read_labels(line, sample)) return false;
  }
  return read_value(line.rest(), &sample->value);
}

}  // namespace

absl::string_view MetricSample::label(absl::string_view key) const {
  for (const auto& [label_name, text] : labels)
    if (label_name == key) return text;
  return {};
}

absl::StatusOr<std::vector<MetricSample>> parse_metrics(absl::string_view text) {
  std::vector<MetricSample> samples;
  size_t line_number = 0;
  for (absl::string_view line : absl::StrSplit(text, '\n')) {
    ++line_number;
    if (line.size() > kMaxMetricLineBytes)
      return absl::ResourceExhaustedError(
          absl::StrCat("line ", line_number, " of the metrics is longer than ", kMaxMetricLineBytes, " bytes"));
    line = absl::StripAsciiWhitespace(line);
    if (line.empty() || line.front() == '#') continue;
    if (samples.size() == kMaxMetricSamples)
      return absl::ResourceExhaustedError(absl::StrCat("more than ", kMaxMetricSamples, " metrics"));
    MetricSample sample;
    if (!read_sample(line, &sample))
      return absl::InvalidArgumentError(absl::StrCat(
          "line ", line_number, " is no metric in Prometheus's text format; is it the HTTP port of locusd?"));
    samples.push_back(std::move(sample));
  }
  return samples;
}

}  // namespace locus::cli
